"""The pit wall: a race served to a page that shows it, the call, and its reasons."""
