"""The public functions of `import lab`, one for each command, and the records that they return."""
