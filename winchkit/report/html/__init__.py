"""Self-contained HTML: escaped markup, SVG charts, the page with its styles and scripts."""
