"""Studies: cases with a published or independent answer; each command writes table and figure."""
