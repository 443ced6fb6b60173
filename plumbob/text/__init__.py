"""The ground floor of texts: sentences, translations, pages, and what is safe to print."""
