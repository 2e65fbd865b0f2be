"""Hard cases: what is asked, of which stage, and what is expected; ``conftest.py`` makes a page of what they found."""
