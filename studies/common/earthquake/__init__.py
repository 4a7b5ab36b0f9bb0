"""Earthquakes: motions of rock, the response of a site, sliding blocks."""
