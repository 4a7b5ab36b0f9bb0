"""The command ``talus``: runs studies, lists them, begins new ones, and says what is installed."""
