"""What the studies share: options, results folder, history, progress, interruption, pictures and animations."""
