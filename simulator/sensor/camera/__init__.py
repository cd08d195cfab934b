"""The camera body: geometry, colour response, and the parameters set by its ISO."""
