"""Plans and audits as tables of a console."""
