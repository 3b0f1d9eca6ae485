"""Replace, append and select the laws of a regression of the force balance (`regression.py`).

Where a law is replaced, the products of the blocks are updated for its columns alone.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from analysis.diagnosis.balance.blocks import Block, build_blocks, compute_scale
from analysis.diagnosis.balance.laws.law import Law
from analysis.diagnosis.balance.regression import Regression, make_law_columns
from equalizer.signals.signal import FloatArray


def copy_columns(regression: Regression) -> Regression:
    """Copy the columns, so that `overwrite_law` may change them."""
    return replace(regression, columns=tuple(part.copy() for part in regression.columns))


def overwrite_law(regression: Regression, law_index: int, law: Law) -> Regression | None:
    """Replace the law of this index; None where the new law's columns are zero, not finite or differ in number from
    those of the old law. The arrays in `columns` are changed in place: they must belong to this regression alone."""
    columns = make_law_columns(regression.motions, law)
    updated_regression = _replace_law_products(regression, law_index, law, columns)
    for part, new_columns in zip(regression.columns, columns or (), strict=True) if updated_regression else ():
        part[:, regression.column_ranges[law_index]] = new_columns
    return updated_regression


def try_law(regression: Regression, law_index: int, law: Law) -> Regression | None:
    """Replace the law of this index in all but `columns`, which is enough to fit and to cross-validate. None as in
    `overwrite_law`."""
    return _replace_law_products(regression, law_index, law, make_law_columns(regression.motions, law))


def _replace_law_products(
    regression: Regression, law_index: int, law: Law, columns: Sequence[FloatArray] | None
) -> Regression | None:
    """Replace law, scale and products of this index by those of columns (n, k) per motion; None where these are None or
    differ in number."""
    column_range = regression.column_ranges[law_index]
    if columns is None or columns[0].shape[1] != column_range.stop - column_range.start:
        return None
    scale = regression.scale.copy()
    scale[column_range] = compute_scale(
        columns, [motion.mask_valid_samples(motion.fit) for motion in regression.motions]
    )
    fit, test = (
        tuple(
            _update_products(regression, block, (column_range, scale), columns[block.motion_index]) for block in blocks
        )
        for blocks in (regression.fit, regression.test)
    )
    laws = (*regression.laws[:law_index], law, *regression.laws[law_index + 1 :])
    return replace(regression, laws=laws, scale=scale, fit=fit, test=test)


def append_laws(regression: Regression, laws: Sequence[Law]) -> Regression:
    """Append laws to a regression, except those whose columns are zero or not finite."""
    added_laws, rows = [], [[part] for part in regression.columns]
    ends = [regression.columns[0].shape[1]]
    for law in laws:
        columns = make_law_columns(regression.motions, law)
        if columns is not None:
            added_laws.append(law)
            ends.append(ends[-1] + columns[0].shape[1])
            for column_parts, new_columns in zip(rows, columns, strict=True):
                column_parts.append(new_columns)
    extended = tuple(np.hstack(part) for part in rows)
    fit_masks = [motion.mask_valid_samples(motion.fit) for motion in regression.motions]
    test_masks = [motion.mask_valid_samples(motion.test) for motion in regression.motions]
    scale = np.concatenate([regression.scale, compute_scale([part[:, ends[0] :] for part in extended], fit_masks)])
    mean = np.concatenate([target[mask] for target, mask in zip(regression.force, fit_masks, strict=True)]).mean()
    normalisation = scale, float(mean)
    return replace(
        regression,
        laws=(*regression.laws, *added_laws),
        column_ranges=(*regression.column_ranges, *(slice(start, end) for start, end in pairwise(ends))),
        scale=scale,
        columns=extended,
        fit=build_blocks(extended, regression.force, fit_masks, normalisation),
        test=build_blocks(extended, regression.force, test_masks, normalisation),
    )


def keep_laws(regression: Regression, law_indices: Sequence[int]) -> Regression:
    """Reduce a regression to the laws of these indices, in this order."""
    columns = regression.select_columns(law_indices)
    widths = [regression.column_ranges[k].stop - regression.column_ranges[k].start for k in law_indices]
    ends = np.cumsum([regression.base_column_count, *widths]).tolist()
    return replace(
        regression,
        laws=tuple(regression.laws[k] for k in law_indices),
        column_ranges=tuple(slice(start, end) for start, end in pairwise(ends)),
        scale=regression.scale[columns],
        columns=tuple(part[:, columns] for part in regression.columns),
        fit=tuple(_select_block_columns(block, columns) for block in regression.fit),
        test=tuple(_select_block_columns(block, columns) for block in regression.test),
    )


def _select_block_columns(block: Block, columns: Sequence[int]) -> Block:
    """Reduce a block to the products of these columns, in this order."""
    return replace(block, gram=block.gram[np.ix_(columns, columns)], cross=block.cross[list(columns)])


def _update_products(
    regression: Regression, block: Block, range_and_scale: tuple[slice, FloatArray], columns: FloatArray
) -> Block:
    """Recompute the products of a block's columns in a range, which are replaced by `columns` (kept samples, k) of its
    motion. range_and_scale: the range, and the scale (all columns,) with that of the new ones."""
    column_range, scale = range_and_scale
    scaled_columns = regression.columns[block.motion_index][block.rows] / scale
    scaled_columns[:, column_range] = columns[block.rows] / scale[column_range]
    gram, cross = block.gram.copy(), block.cross.copy()
    gram[:, column_range] = scaled_columns.T @ scaled_columns[:, column_range]
    gram[column_range, :] = gram[:, column_range].T
    cross[column_range] = scaled_columns[:, column_range].T @ regression.force[block.motion_index][block.rows]
    return replace(block, gram=gram, cross=cross)
