"""Section IV of the paper, again: its runs, tables, figures and claims, and one page that shows them."""
