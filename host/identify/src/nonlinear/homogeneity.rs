//! Homogeneity at constant frequency: ranges of the force amplitude in which the response amplitude is linear in it,
//! and jumps between them (thesis section 4.2.3).

use crate::criteria::{CURVATURE_SHARE, JUMP_DEVIATIONS, JUMP_SHARE, LEAST_REGION_POINTS, REGION_EVIDENCE};

/// A range of force at constant frequency in which the response amplitude is a linear function of the force amplitude.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Region {
    /// Smallest force, N.
    pub from_n: f64,
    /// Largest force, N.
    pub to_n: f64,
    /// Slope dX/dF of the response amplitude X over the force amplitude F in this range, m/N.
    pub slope: f64,
}

/// Regions in which the response amplitude X(F) is linear, at constant frequency under a slowly changing force
/// amplitude F, and the forces at which X jumps (thesis Fig. 4.8).
///
/// `points` are pairs (F, X) in any order. A region is split in two if two lines reduce the sum of squared residuals by
/// much more than noise does. The response jumps where two neighbouring lines differ by more than six standard
/// deviations of the noise and more than 5 % of X.
pub fn regions(points: &[(f64, f64)]) -> (Vec<Region>, Vec<f64>) {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Second differences of X estimate the noise: for white noise with the standard deviation σ their standard
    // deviation is √6·σ.
    let mut bends: Vec<f64> = sorted
        .windows(3)
        .map(|w| (w[2].1 - 2.0 * w[1].1 + w[0].1).abs())
        .collect();
    bends.sort_by(f64::total_cmp);
    let noise = bends.get(bends.len() / 2).copied().unwrap_or(0.0) / (0.6745 * 6.0_f64.sqrt());
    // The curvature of the response X(F) within one region is not noise: deviations of 0.2 % of the largest response
    // are allowed for.
    let largest = sorted.iter().fold(0.0_f64, |a, (_, x)| a.max(x.abs()));
    let noise = noise.max(CURVATURE_SHARE * largest);
    let mut cuts = vec![0, sorted.len()];
    split_line(&sorted, 0, sorted.len(), noise.max(f64::MIN_POSITIVE), &mut cuts);
    cuts.sort_unstable();
    join_lines(&sorted, noise, &mut cuts);
    let lines: Vec<(usize, usize, [f64; 2])> = cuts
        .windows(2)
        .filter(|pair| pair[1] > pair[0] + 1)
        .map(|pair| (pair[0], pair[1], line(&sorted[pair[0]..pair[1]])))
        .collect();
    let regions = lines
        .iter()
        .map(|&(from, to, [_, slope])| Region {
            from_n: sorted[from].0,
            to_n: sorted[to - 1].0,
            slope,
        })
        .collect();
    let jumps = lines
        .windows(2)
        .filter_map(|pair| {
            let at = 0.5 * (sorted[pair[0].1 - 1].0 + sorted[pair[1].0].0);
            let value = |[level, slope]: [f64; 2]| level + slope * at;
            let miss = (value(pair[1].2) - value(pair[0].2)).abs();
            // A jump exceeds six standard deviations of the noise of X, and 5 % of X, which is more than the curvature
            // of a smooth response gives between two neighbouring lines.
            (miss > JUMP_DEVIATIONS * noise && miss > JUMP_SHARE * value(pair[0].2).abs()).then_some(at)
        })
        .collect();
    (regions, jumps)
}

fn split_line(points: &[(f64, f64)], from: usize, to: usize, noise: f64, cuts: &mut Vec<usize>) {
    if to < from + 2 * LEAST_REGION_POINTS {
        return;
    }
    let whole = misfit(&points[from..to]);
    let best = (from + LEAST_REGION_POINTS..=to - LEAST_REGION_POINTS)
        .map(|cut| (misfit(&points[from..cut]) + misfit(&points[cut..to]), cut))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((sum, cut)) = best
        && (whole - sum) / (noise * noise) > REGION_EVIDENCE
    {
        cuts.push(cut);
        split_line(points, from, cut, noise, cuts);
        split_line(points, cut, to, noise, cuts);
    }
}

/// Removes breaks between regions that do not reduce the sum of squared residuals significantly: the first break found
/// in data of three lines may lie within one of them.
fn join_lines(points: &[(f64, f64)], noise: f64, cuts: &mut Vec<usize>) {
    let mut index = 1;
    while index + 1 < cuts.len() {
        let (from, cut, to) = (cuts[index - 1], cuts[index], cuts[index + 1]);
        let gain = misfit(&points[from..to]) - misfit(&points[from..cut]) - misfit(&points[cut..to]);
        if gain <= REGION_EVIDENCE * noise * noise {
            cuts.remove(index);
        } else {
            index += 1;
        }
    }
}

/// Value at x = 0 and slope of the least-squares line through the points (x, y).
pub(crate) fn line(points: &[(f64, f64)]) -> [f64; 2] {
    let n = points.len() as f64;
    let (sx, sy) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
    let (mx, my) = (sx / n, sy / n);
    let (sxx, sxy) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| {
        (a + (x - mx) * (x - mx), b + (x - mx) * (y - my))
    });
    let slope = if sxx > 0.0 { sxy / sxx } else { 0.0 };
    [my - slope * mx, slope]
}

fn misfit(points: &[(f64, f64)]) -> f64 {
    let [level, slope] = line(points);
    points.iter().map(|(x, y)| (y - level - slope * x).powi(2)).sum()
}
