"""What a person looks at: the 3D page and replay in meshcat's viewer, movies, plots, charts, and summaries in the terminal."""
