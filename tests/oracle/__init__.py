"""Independent solutions for cases that no published or stored reference covers."""
