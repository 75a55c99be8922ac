"""What pictures and the viewer share: the look of links, colours, and from where one looks. No matplotlib here."""
