"""Values and figures to one page of HTML that stands alone."""
