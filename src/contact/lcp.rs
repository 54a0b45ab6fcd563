//! A small linear complementarity problem with a positive semidefinite matrix.

/// Solves x ≥ 0, A x − b ≥ 0, x · (A x − b) = 0, for a symmetric positive semidefinite A in rows, by the active-set
/// method of Lawson and Hanson (Solving Least Squares Problems, 1974, ch. 23).
///
/// `wanted` is b. A row that no x ≥ 0 can meet beside the others is excluded.
pub(super) fn solve(matrix: &[f64], wanted: &[f64]) -> Vec<f64> {
    let size = wanted.len();
    let mut x = vec![0.0; size];
    let mut active: Vec<usize> = Vec::new();
    let mut barred = vec![false; size];
    let largest = wanted.iter().fold(0.0, |most: f64, b| most.max(b.abs()));
    // Each pass activates one row. The limit ends cycles, which rounding may cause.
    for _ in 0..3 * size {
        let missing = |i: usize| wanted[i] - row(matrix, size, i, &x);
        let next = (0..size)
            .filter(|i| !barred[*i] && !active.contains(i))
            .map(|i| (i, missing(i)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((next, _)) = next.filter(|(_, short)| *short > 1e-13 * largest) else {
            break;
        };
        active.push(next);
        if !settle(matrix, wanted, &mut x, &mut active) {
            // The row depends on the active ones.
            active.pop();
            barred[next] = !exchange(matrix, next, &mut x, &mut active);
            settle(matrix, wanted, &mut x, &mut active);
        }
    }
    x
}

/// Approaches the solution by a number of Gauss-Seidel sweeps from zero, which stay bounded where no x ≥ 0 meets all rows.
pub(super) fn relax(matrix: &[f64], wanted: &[f64], sweeps: usize) -> Vec<f64> {
    let size = wanted.len();
    let mut x = vec![0.0; size];
    for i in (0..sweeps).flat_map(|_| 0..size) {
        let missing = wanted[i] - row(matrix, size, i, &x);
        let yields = matrix[i * size + i];
        if yields > 0.0 {
            x[i] = not_below_zero(x[i] + missing / yields);
        }
    }
    x
}

fn row(matrix: &[f64], size: usize, i: usize, x: &[f64]) -> f64 {
    let row = &matrix[i * size..(i + 1) * size];
    row.iter().zip(x).map(|(a, x)| a * x).sum()
}

/// Solves for the active rows alone, and drops those that would become negative. Returns false if the active rows are
/// dependent.
fn settle(matrix: &[f64], wanted: &[f64], x: &mut [f64], active: &mut Vec<usize>) -> bool {
    while !active.is_empty() {
        let Some(trial) = eliminate(matrix, wanted, active) else {
            return false;
        };
        // The first entry that becomes negative on the way to `trial`, and the share of the way up to there.
        let ends = active.iter().zip(&trial).enumerate();
        let ends = ends.filter(|(_, (_, to))| **to < 0.0);
        let ends = ends.map(|(at, (i, to))| (at, x[*i] / (x[*i] - to)));
        let first = ends.min_by(|a, b| a.1.total_cmp(&b.1));
        let share = first.map_or(1.0, |(_, share)| share);
        for (i, to) in active.iter().zip(&trial) {
            x[*i] = not_below_zero(x[*i] + share * (to - x[*i]));
        }
        let Some((at, _)) = first else {
            return true;
        };
        x[active.remove(at)] = 0.0;
    }
    true
}

/// Activates a row that is a combination of active rows. More of it, and as much less of these, changes no row of A x,
/// until one of these is zero, which is dropped. Returns false if none becomes zero: no x ≥ 0 meets all of these rows.
fn exchange(matrix: &[f64], next: usize, x: &mut [f64], active: &mut [usize]) -> bool {
    let column: Vec<f64> = (0..x.len()).map(|i| matrix[i * x.len() + next]).collect();
    let Some(shares) = eliminate(matrix, &column, active) else {
        return false;
    };
    let largest = shares.iter().fold(0.0, |most: f64, it| most.max(it.abs()));
    // Smaller shares are rounding.
    let limits = shares.iter().zip(&*active).enumerate();
    let limits = limits.filter(|(_, (share, _))| **share > 1e-9 * largest);
    let limits = limits.map(|(at, (share, i))| (at, x[*i] / share));
    let Some((at, most)) = limits.min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return false;
    };
    for (i, share) in active.iter().zip(&shares) {
        x[*i] = not_below_zero(x[*i] - most * share);
    }
    x[active[at]] = 0.0;
    x[next] = most;
    active[at] = next;
    true
}

/// Zero for a negative number. NaN stays, so that the caller sees it; `f64::max` would turn it into zero.
fn not_below_zero(x: f64) -> f64 {
    if x < 0.0 { 0.0 } else { x }
}

/// Solves the active rows by L D Lᵀ elimination; `None` if they are dependent.
fn eliminate(matrix: &[f64], wanted: &[f64], active: &[usize]) -> Option<Vec<f64>> {
    let (size, count) = (wanted.len(), active.len());
    let mut lower = vec![0.0; count * count];
    let mut pivots = vec![0.0; count];
    for r in 0..count {
        for c in 0..=r {
            let before: f64 = (0..c)
                .map(|k| lower[r * count + k] * lower[c * count + k] * pivots[k])
                .sum();
            let entry = matrix[active[r] * size + active[c]] - before;
            if r != c {
                lower[r * count + c] = entry / pivots[c];
            } else if entry > 1e-12 * matrix[active[r] * size + active[r]] {
                pivots[r] = entry;
            } else {
                return None;
            }
        }
    }
    let mut x: Vec<f64> = active.iter().map(|i| wanted[*i]).collect();
    for r in 0..count {
        let before: f64 = (0..r).map(|k| lower[r * count + k] * x[k]).sum();
        x[r] -= before;
    }
    for r in (0..count).rev() {
        let after: f64 = (r + 1..count).map(|k| lower[k * count + r] * x[k]).sum();
        x[r] = x[r] / pivots[r] - after;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_row_is_a_division() {
        assert_eq!(solve(&[4.0], &[2.0]), [0.5]);
        assert_eq!(solve(&[4.0], &[-2.0]), [0.0]);
        assert_eq!(solve(&[0.0], &[1.0]), [0.0]);
        assert!(solve(&[], &[]).is_empty());
    }

    #[test]
    fn a_row_that_would_become_negative_is_dropped() {
        // Alone, the rows give 1 and 0.5; together the second would be negative.
        let x = solve(&[2.0, 1.9, 1.9, 2.0], &[2.0, 1.0]);
        assert_eq!(x, [1.0, 0.0]);
        let x = solve(&[2.0, -1.0, -1.0, 2.0], &[1.0, 1.0]);
        assert!(
            (x[0] - 1.0).abs() < 1e-15 && (x[1] - 1.0).abs() < 1e-15,
            "{x:?}"
        );
    }

    #[test]
    fn an_overflow_shows_in_every_entry() {
        let (one, half) = (1e-300, -5e-301);
        let x = solve(&[one, half, half, one], &[1e301, 1e300]);
        assert!(x.iter().all(|x| !x.is_finite()), "{x:?}");
    }

    /// Two rows that contradict each other but for a small part: the solution has no measure, and the sweeps have.
    #[test]
    fn sweeps_are_bounded_where_a_solution_is_not() {
        let nearly = -1.0 + 1e-9;
        let (jam, wanted) = ([1.0, nearly, nearly, 1.0], [1.0, 1.0]);
        assert!(solve(&jam, &wanted)[0] > 1e8);
        let x = relax(&jam, &wanted, 8);
        assert!(x.iter().all(|x| (1.0..=16.0).contains(x)), "{x:?}");
        let sound = [2.0, 1.0, 1.0, 2.0];
        let x = relax(&sound, &[4.0, 5.0], 40);
        assert!(
            (x[0] - 1.0).abs() < 1e-9 && (x[1] - 2.0).abs() < 1e-9,
            "{x:?}"
        );
    }

    #[test]
    fn equal_rows_are_solved_as_one() {
        let x = solve(&[1.0, 1.0, 1.0, 1.0], &[3.0, 3.0]);
        assert!((x[0] + x[1] - 3.0).abs() < 1e-14, "{x:?}");
    }

    #[test]
    fn solutions_of_random_problems_meet_the_conditions() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        // With fewer columns than rows, as at the four corners of a box, rows depend on each other.
        for (size, rank) in (1..=12).flat_map(|size| (1..=size).map(move |rank| (size, rank))) {
            for _ in 0..10 {
                // The first column is positive, so that a multiple of it meets all rows.
                let shift = |at: usize| if at.is_multiple_of(rank) { 0.6 } else { 0.0 };
                let factor: Vec<f64> = (0..size * rank).map(|at| random() + shift(at)).collect();
                let entry = |i: usize, j: usize| -> f64 {
                    let product = |k: usize| factor[i * rank + k] * factor[j * rank + k];
                    (0..rank).map(product).sum()
                };
                let matrix: Vec<f64> = (0..size * size)
                    .map(|at| entry(at / size, at % size))
                    .collect();
                let wanted: Vec<f64> = (0..size).map(|_| random()).collect();
                let x = solve(&matrix, &wanted);
                for i in 0..size {
                    let rest = row(&matrix, size, i, &x) - wanted[i];
                    assert!(
                        x[i] >= 0.0 && rest > -1e-10 && (x[i] * rest).abs() < 1e-8,
                        "{i} {x:?}"
                    );
                }
            }
        }
    }
}
