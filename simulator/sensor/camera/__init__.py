"""The camera body: geometry, colour response, and what its ISO dial sets."""
