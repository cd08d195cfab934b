"""DNG files: tags, payload and writer."""
