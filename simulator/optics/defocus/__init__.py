"""The blur of surfaces out of focus: its plan and its passes."""
