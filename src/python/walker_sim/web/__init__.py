"""A page in the browser that shows and steers a walker, by viser."""
