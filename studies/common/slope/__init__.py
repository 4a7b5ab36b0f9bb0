"""The slope of the studies, and sites cut as a slope."""
