//! Effects hidden in virtual cuts.

use std::time::Instant;

use super::record::ReducedCut;
use super::selection::explain;
use crate::baseline::Baseline;
use crate::tests::cutting::{case, records};

#[test]
fn effects_are_ranked_first() {
    let hidden: [&[&str]; 12] = [
        &[],
        &["force-coefficients=0.2"],
        &["runout=20", "runout.angle_deg=40"],
        &["process-damping=2e5"],
        &["edge-force=1.5", "edge-force.kre_n_per_mm=1"],
        &["force-exponent=0.75", "force-exponent.reference_chip_mm=0.1"],
        &["stiffness=0.1"],
        &["mass=0.15", "mass.direction=y"],
        &["cubic-stiffness=-5e11", "cubic-stiffness.direction=x"],
        &["coulomb-friction=0.3", "coulomb-friction.direction=y"],
        &["sensor-gain=1.1", "sensor-gain.channel=x"],
        &["backlash=0.01", "backlash.direction=y"],
    ];
    for effects in hidden {
        let baseline_case = case("0.15", "");
        let baseline = Baseline::new(&baseline_case).unwrap();
        let recordings = records(effects, true, 7);
        let start = Instant::now();
        let reduced: Vec<ReducedCut> = recordings
            .iter()
            .map(|recording| ReducedCut::new(&baseline, recording).unwrap())
            .collect();
        let count: usize = reduced.iter().map(ReducedCut::count).sum();
        let reduction = start.elapsed();
        let explanations = explain(&baseline, &reduced).unwrap();
        let fit = &explanations.baseline.fit;
        println!(
            "{effects:?}: {count} values, baseline {:.3}, {} variables, {reduction:?} + {:?}",
            fit.left / count as f64,
            fit.z.len(),
            start.elapsed() - reduction
        );
        for ranked in explanations.ranked.iter().take(3) {
            let names: Vec<String> = ranked
                .space
                .candidates
                .iter()
                .enumerate()
                .map(|(number, candidate)| {
                    let z = ranked.space.coordinates(number, &ranked.fit.z);
                    format!(
                        "{} {} {:?}",
                        candidate.effect.name(),
                        candidate.location,
                        candidate.parameters(&z)
                    )
                })
                .collect();
            println!(
                "    {:.1} {:.3} {names:?}",
                ranked.evidence - explanations.baseline.evidence,
                ranked.fit.left / count as f64
            );
        }
    }
}
