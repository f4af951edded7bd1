"""Pictures of an arm in its cell, as SVG."""
