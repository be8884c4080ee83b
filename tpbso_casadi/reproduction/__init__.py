"""The paper's Section IV reproduced: its runs, tables, figures and claims, and one page that shows them."""
