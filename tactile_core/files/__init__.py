"""Read and write files whatever they hold: atomic writing, checked reading, pictures, locks, caches, provenance."""
