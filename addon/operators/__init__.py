"""Operators of buttons and menus: import, translate, simulate, render."""
