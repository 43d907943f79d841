"""Studies: cases with a published or independent answer, as commands that write table and figure."""
