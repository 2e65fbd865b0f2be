"""What buttons and menus do: import, translate, simulate, render."""
