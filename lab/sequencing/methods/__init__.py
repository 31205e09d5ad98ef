"""The sequencing methods, a file for each, and the records and kernels that several of them share."""
