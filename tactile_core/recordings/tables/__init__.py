"""Tables of named columns: parsed from text, or made of arrays; and maps that say which column is what."""
