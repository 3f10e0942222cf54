"""One file per verb: each has the options of the verb, calls the library and prints the result."""
