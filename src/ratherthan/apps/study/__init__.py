"""A study with people: designed as a file, served to browsers, analysed as a table."""
