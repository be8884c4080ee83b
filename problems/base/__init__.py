"""What every floor above uses: matrices, symbolic or numeric, and what a statement that makes no sense raises."""
