"""Reports: values and figures as a self-contained page of HTML."""
