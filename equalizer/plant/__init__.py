"""Models of the device: mechanical (as a lab writes them down), identified, and the names of effects."""
