"""What a person looks at: frames (plain records), the meshcat page and replay, plots, the terminal."""
