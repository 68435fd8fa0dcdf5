"""The machine on a page in the browser: `guideload app`. It uses the public API of guideload alone."""
