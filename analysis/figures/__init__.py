"""Figures: values in, Matplotlib figures out. Nothing is written here.

One subject a file. A file named `…_pictures` gathers all figures of one report, in its order (`study_pictures`,
`look_pictures`, `blind_test_pictures`, `reproduction_pictures`, and `diagnosis/` for a diagnosis); the others draw one
figure each. All draw with the colours and axes of `style` and hand on a `picture`: the figure with its title, its
caption and its text for screen readers.
"""
