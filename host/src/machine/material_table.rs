//! Ranges of cutting coefficients from the literature, each with its source.
//!
//! A row of single coefficients belongs here only with author, year, table and the range of chip thickness for which it
//! was measured.

/// Range of the cutting coefficients of a class of materials over the tests of several authors.
///
/// The sources of a range state no chip thickness. A range is no standard deviation: where one value in it is as likely
/// as another, the mean is (a + b)/2 and the standard deviation (b − a)/√12.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialRange {
    /// Word on the command line.
    pub name: &'static str,
    /// The class.
    pub what: &'static str,
    /// Least and largest tangential specific cutting coefficient of the class, MPa.
    pub ktc_mpa: [f64; 2],
    /// Least and largest ratio krc/ktc of the radial to the tangential specific cutting coefficient.
    pub radial_ratio: [f64; 2],
    /// Source of the range: author, year and table.
    pub source: &'static str,
}

/// Classes of materials for which the literature gives a range of cutting coefficients, but no single values.
pub const RANGES: &[MaterialRange] = &[MaterialRange {
    name: "aluminium-alloy",
    what: "aluminium alloys 6061, 6082 and 7075, milled dry with cemented carbide",
    ktc_mpa: [243.77, 1319.41],
    radial_ratio: [99.0 / 631.0, 788.83 / 1319.41],
    source: "Duan et al., Milling Force Model for Aviation Aluminum Alloy, Chinese Journal of Mechanical Engineering 34:18, 2021, table 5",
}];

impl MaterialRange {
    /// Range of cutting coefficients of the material class with this name; `None` if there is no such class.
    pub fn of(name: &str) -> Option<&'static Self> {
        RANGES.iter().find(|range| range.name == name)
    }

    /// Mean and standard deviation of a value that lies anywhere in a range with equal probability.
    pub fn mean_and_std([from, to]: [f64; 2]) -> (f64, f64) {
        (0.5 * (from + to), (to - from) / 12.0_f64.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_range_has_a_source_with_a_year() {
        for range in RANGES {
            assert!(range.source.contains("20"), "{range:?}");
            assert!(
                0.0 < range.ktc_mpa[0] && range.ktc_mpa[0] < range.ktc_mpa[1],
                "{range:?}"
            );
            assert_eq!(MaterialRange::of(range.name), Some(range));
        }
        assert!(MaterialRange::of("cheese").is_none());
    }

    #[test]
    fn a_range_becomes_the_deviation_of_a_uniform_distribution() {
        let (mean, std) = MaterialRange::mean_and_std([0.0, 12.0]);
        assert!((mean - 6.0).abs() < 1e-15 && (std - 12.0_f64.sqrt()).abs() < 1e-15);
    }
}
