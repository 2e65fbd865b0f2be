"""Convert a public set of recordings, by its recipe, to labelled pictures with a card and a page to look at."""
