//! Products of tall matrices, computed in blocks of two columns (register blocking; Golub & Van
//! Loan, *Matrix Computations*, section 1.5). Leading and trailing zeros of columns are skipped.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use didim_dynamics::numeric::{Lanes, Scalar, WIDTH, with_vector_instructions};

/// Number of values of a column that are computed in parallel.
const VALUES_AT_ONCE: usize = WIDTH;

/// Returns AᵀB of matrices with the same number of rows, if the product is known to be symmetric.
/// Leading and trailing zeros of the columns are skipped.
pub(crate) fn symmetric_product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(a.ncols(), b.ncols());
    with_vector_instructions(
        #[inline(always)]
        || {
            // Two columns of each matrix at a time. The last one counts twice if their number is
            // odd.
            let lefts: Vec<_> = (0..a.ncols()).step_by(2).map(|i| not_zero(pair(a, i))).collect();
            for j in (0..b.ncols()).step_by(2) {
                let right = pair(b, j);
                let of_right = not_zero(right);
                for (i, of_left) in (0..a.ncols().min(j + 2)).step_by(2).zip(&lefts) {
                    let end = of_left.end.min(of_right.end);
                    let rows = of_left.start.max(of_right.start).min(end)..end;
                    let first_columns = pair(a, i);
                    let right = right.map(|column| &column[rows.clone()]);
                    let dots =
                        dot_products(first_columns.map(|column| &column[rows.clone()]), right);
                    for (j, dots) in (j..b.ncols()).zip(dots) {
                        for (i, dot) in (i..a.ncols()).zip(dots) {
                            product[(i, j)] = dot;
                        }
                    }
                }
            }
        },
    );
    product.fill_lower_triangle_with_upper_triangle();
    product
}

/// Returns the range of rows that contains all non-zero values of both columns. The range is
/// extended to multiples of the vector length, so that the product is the same to the last bit.
fn not_zero(columns: [&[f64]; 2]) -> Range<usize> {
    let rows = columns[0].len();
    let first = columns.map(|column| column.iter().position(|value| *value != 0.0));
    let last = columns.map(|column| column.iter().rposition(|value| *value != 0.0));
    let Some(first) = first.into_iter().flatten().min() else { return 0..0 };
    let end = last.into_iter().flatten().max().map_or(rows, |last| last + 1);
    first - first % VALUES_AT_ONCE..end.next_multiple_of(VALUES_AT_ONCE).min(rows)
}

/// Returns column k and the next one, or the last column twice.
#[inline(always)]
fn pair(matrix: &DMatrix<f64>, k: usize) -> [&[f64]; 2] {
    [k, (k + 1).min(matrix.ncols() - 1)].map(|k| column(matrix, k))
}

#[inline(always)]
fn column(matrix: &DMatrix<f64>, index: usize) -> &[f64] {
    &matrix.as_slice()[index * matrix.nrows()..(index + 1) * matrix.nrows()]
}

/// Returns the products of each right column with each left column.
#[inline(always)]
fn dot_products([a, b]: [&[f64]; 2], [c, d]: [&[f64]; 2]) -> [[f64; 2]; 2] {
    let mut sums = [[Lanes::zero(); 2]; 2];
    let ((a, a_rest), (b, b_rest)) =
        (a.as_chunks::<VALUES_AT_ONCE>(), b.as_chunks::<VALUES_AT_ONCE>());
    let ((c, c_rest), (d, d_rest)) =
        (c.as_chunks::<VALUES_AT_ONCE>(), d.as_chunks::<VALUES_AT_ONCE>());
    for ((a, b), (c, d)) in a.iter().zip(b).zip(c.iter().zip(d)) {
        let (a, b, c, d) = (Lanes(*a), Lanes(*b), Lanes(*c), Lanes(*d));
        sums[0][0] += a * c;
        sums[0][1] += b * c;
        sums[1][0] += a * d;
        sums[1][1] += b * d;
    }
    let sum_of_all = |Lanes(sum): Lanes<VALUES_AT_ONCE>, remaining: &[f64], right: &[f64]| {
        let rest = remaining.iter().zip(right).map(|(rest, right)| rest * right);
        rest.fold((sum[0] + sum[2]) + (sum[1] + sum[3]), |sum, product| sum + product)
    };
    [
        [sum_of_all(sums[0][0], a_rest, c_rest), sum_of_all(sums[0][1], b_rest, c_rest)],
        [sum_of_all(sums[1][0], a_rest, d_rest), sum_of_all(sums[1][1], b_rest, d_rest)],
    ]
}

/// Number of partial sums of a scalar product, which hide the latency of the additions.
const PRODUCTS_AT_ONCE: usize = 16;

#[inline(always)]
pub(super) fn dot(remaining: &[f64], right: &[f64]) -> f64 {
    let ((rest, left_rest), (right, right_rest)) =
        (remaining.as_chunks::<PRODUCTS_AT_ONCE>(), right.as_chunks::<PRODUCTS_AT_ONCE>());
    let mut sums = Lanes::<PRODUCTS_AT_ONCE>::zero();
    for (rest, right) in rest.iter().zip(right) {
        sums += Lanes(*rest) * Lanes(*right);
    }
    let rest = left_rest.iter().zip(right_rest).map(|(one, right)| one * right);
    rest.chain(sums.0).sum()
}

/// Returns the scalar product of two vectors.
pub(super) fn dot_of(one: &[f64], right: &[f64]) -> f64 {
    with_vector_instructions(
        #[inline(always)]
        || dot(one, right),
    )
}

/// Subtracts `factor` times another vector.
#[inline(always)]
pub(super) fn subtract_scaled(vector: &mut [f64], factor: f64, other: &[f64]) {
    let scale = Lanes::constant(factor);
    let ((vector, rest), (other, other_rest)) =
        (vector.as_chunks_mut::<WIDTH>(), other.as_chunks::<WIDTH>());
    for (values, other) in vector.iter_mut().zip(other) {
        *values = (Lanes(*values) - scale * Lanes(*other)).0;
    }
    for (value, other) in rest.iter_mut().zip(other_rest) {
        *value -= factor * other;
    }
}

/// Subtracts from `vector` its component along the unit vector `of`.
pub(super) fn subtract_share(vector: &mut [f64], of: &[f64]) {
    with_vector_instructions(
        #[inline(always)]
        || subtract_scaled(vector, dot(of, vector), of),
    );
}

/// Returns Aᵀ v.
pub(crate) fn transposed_times(a: &DMatrix<f64>, v: &[f64]) -> DVector<f64> {
    let mut products = DVector::zeros(a.ncols());
    with_vector_instructions(
        #[inline(always)]
        || {
            let columns = a.as_slice().chunks_exact(a.nrows().max(1));
            for (product, column) in products.iter_mut().zip(columns) {
                *product = dot(column, v);
            }
        },
    );
    products
}

/// Adds factor · A B to C. The sum of each entry goes over the columns of A in order.
pub(super) fn add_product(c: &mut DMatrix<f64>, factor: f64, a: &DMatrix<f64>, b: &DMatrix<f64>) {
    /// Number of rows at a time, for which a block of A fits in the nearest cache.
    const ROWS_AT_ONCE: usize = 64;
    let rows = a.nrows();
    with_vector_instructions(
        #[inline(always)]
        || {
            for first in (0..rows).step_by(ROWS_AT_ONCE) {
                let range = first..rows.min(first + ROWS_AT_ONCE);
                for (b, c) in b.column_iter().zip(c.as_mut_slice().chunks_exact_mut(rows)) {
                    let c = &mut c[range.clone()];
                    for (b, a) in b.iter().zip(a.as_slice().chunks_exact(rows)) {
                        let b = factor * b;
                        for (c, a) in c.iter_mut().zip(&a[range.clone()]) {
                            *c += a * b;
                        }
                    }
                }
            }
        },
    );
}

/// Returns A B.
pub(super) fn matrix_product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut c = DMatrix::zeros(a.nrows(), b.ncols());
    add_product(&mut c, 1.0, a, b);
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_those_of_nalgebra() {
        let matrix = |rows, columns, seed: usize| {
            DMatrix::from_fn(rows, columns, |i, j| {
                (((i * 31 + j * 17 + seed) * 53) % 101) as f64 / 101.0 - 0.5
            })
        };
        let vector_of = |rows| matrix(rows, 1, 5).column(0).into_owned();
        for (rows, first, second) in [(1, 1, 1), (3, 2, 5), (67, 4, 2), (130, 9, 7), (64, 28, 3)] {
            let (a, b) = (matrix(rows, first, 1), matrix(rows, second, 2));
            let mut vector = b.column(0).into_owned();
            let expected = &vector - a.column(0) * a.column(0).dot(&vector);
            subtract_share(vector.as_mut_slice(), a.column(0).as_slice());
            assert!((vector - expected).amax() < 1e-13, "{rows}");
            let (b, mut c) = (matrix(first, second, 3), matrix(rows, second, 4));
            let expected = &c - &a * &b;
            add_product(&mut c, -1.0, &a, &b);
            assert!((c - expected).amax() < 1e-13, "{rows}");
            assert!((matrix_product(&a, &b) - &a * &b).amax() < 1e-13, "{rows}");
            let products = transposed_times(&a, vector_of(rows).as_slice());
            assert!((products - a.tr_mul(&vector_of(rows))).amax() < 1e-13, "{rows}");
            let symmetric = symmetric_product(&a, &a);
            assert!((&symmetric - a.transpose() * &a).amax() < 1e-13, "{rows}");
            assert_eq!(symmetric, symmetric.transpose());
        }
        // With zeros at the ends of columns.
        let dense = matrix(67, 5, 1);
        for ends in [[0, 67], [9, 67], [0, 50], [13, 30], [31, 31]] {
            let sparse = DMatrix::from_fn(67, 3, |i, j| {
                if (ends[0] + j..ends[1] + j).contains(&i) { dense[(i, j)] } else { 0.0 }
            });
            let difference = symmetric_product(&sparse, &sparse) - sparse.transpose() * &sparse;
            assert!(difference.amax() < 1e-13, "{ends:?}: {difference}");
        }
        assert_eq!(symmetric_product(&matrix(5, 0, 1), &matrix(5, 0, 1)).shape(), (0, 0));
    }
}
