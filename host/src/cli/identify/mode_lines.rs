//! Lines of the text output of `--method modes`.

use super::figure::Figure;
use crate::identify::modes::{ChannelNoise, ModalModel, ModalParameters};
use crate::report::digits::significant;
use quietcut_numerics::statistics::NINETY_PERCENT;

/// Lines of the modes with their shapes and modal parameters, of the noise of the channels, of the rejected poles, and of the modal assurance
/// criterion `mac` between the modes.
pub(super) fn lines(model: &ModalModel, noise: &[ChannelNoise], mac: Option<&[Vec<f64>]>) -> Vec<String> {
    let mut lines = Vec::new();
    for (index, found) in model.modes.iter().enumerate() {
        let frequency = Figure::new(found.mode.frequency_hz, found.frequency_std_hz);
        let damping = Figure::new(found.mode.damping_ratio, found.damping_ratio_std);
        lines.push(format!(
            "mode at {:.4} Hz (90 % interval {:.4} to {:.4}), damping ratio {:.5} ({:.5} to {:.5})",
            frequency.value,
            frequency.ci90[0],
            frequency.ci90[1],
            damping.value,
            damping.ci90[0],
            damping.ci90[1]
        ));
        let shapes = [
            ("right", &model.responses, &found.mode.right, &found.right_std),
            ("left", &model.forces, &found.mode.left, &found.left_std),
        ];
        for (name, directions, values, deviations) in shapes {
            let entries: Vec<String> = directions
                .iter()
                .zip(values.iter().zip(deviations))
                .map(|(direction, (value, [re, im]))| {
                    format!(
                        "{direction} {:.3}{:+.3}i (±{:.3}, ±{:.3})",
                        1e3 * value.re,
                        1e3 * value.im,
                        1e3 * re,
                        1e3 * im
                    )
                })
                .collect();
            lines.push(format!(
                "  {name} shape, 10⁻³ (one standard deviation): {}",
                entries.join(", ")
            ));
        }
        lines.extend(model.modal_parameters(index).map(|modal| modal_line(&modal)));
    }
    lines.extend(mac.into_iter().flat_map(mac_lines));
    for channel in noise {
        lines.push(format!(
            "noise of {} in {}: {:.3} % of its root mean square",
            channel.channel, channel.recording, channel.percent
        ));
    }
    for pole in &model.rejected {
        lines.push(format!(
            "rejected pole: {:.3} Hz, damping ratio {:.4}: {}",
            pole.frequency_hz, pole.damping_ratio, pole.why
        ));
    }
    lines
}

fn modal_line(modal: &ModalParameters) -> String {
    let part = |[value, std]: [f64; 2], factor: f64| {
        let half = factor * NINETY_PERCENT * std;
        format!("{} ± {}", significant(factor * value, 5), significant(half, 2))
    };
    format!(
        "  in {}: modal mass {} kg, stiffness {} N/µm, damping {} N·s/m (90 % intervals)",
        modal.direction,
        part(modal.mass_kg, 1.0),
        part(modal.stiffness_n_per_m, 1e-6),
        part(modal.damping_ns_per_m, 1.0)
    )
}

/// One line for each mode but a single one, which has no other to compare with.
pub(super) fn mac_lines(mac: &[Vec<f64>]) -> Vec<String> {
    if mac.len() < 2 {
        return Vec::new();
    }
    let row = |(index, row): (usize, &Vec<f64>)| {
        let entries: Vec<String> = row.iter().map(|entry| format!("{entry:.2}")).collect();
        format!(
            "MAC of mode {} with modes 1 to {}: {}",
            index + 1,
            mac.len(),
            entries.join(" ")
        )
    };
    mac.iter().enumerate().map(row).collect()
}
