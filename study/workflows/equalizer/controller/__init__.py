"""A model's controller for loops in C and C++: the tables, and the C sources around them as they are shipped."""
