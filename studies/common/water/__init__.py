"""Seepage, levees, drawdown and rain."""
