"""Common modules of the studies: options, results folder, history, progress, interruption, pictures and animations."""
