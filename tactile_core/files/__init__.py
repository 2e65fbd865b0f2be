"""Files, whatever they hold: atomic writing, checked reading, packs, pictures, locks, caches, provenance."""
