"""File handling independent of content: atomic writing, checked reading, packs, pictures, locks, caches, provenance."""
