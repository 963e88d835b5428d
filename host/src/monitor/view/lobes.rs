//! The lobe chart: unstable depths over the spindle speed, with the working point.

use quietcut_core::lobes::TabulatedStability;
use quietcut_core::units::Millimeters;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::frame::{framed, put};
use super::palette::Palette;
use crate::monitor::lobes::{COLUMNS, LobeMap, letter};
use crate::monitor::received::Received;

/// Draws the lobes of the table around the working point.
pub(super) fn draw(received: &Received, palette: Palette, area: Rect, buffer: &mut Buffer) {
    let Some(lobes) = &received.lobes else {
        let inside = framed(" lobes ", palette, area, buffer);
        put(
            inside,
            0,
            "no table: give it with --table FILE.qct",
            palette.faint(),
            buffer,
        );
        put(
            inside,
            1,
            "(a device does not send its table back)",
            palette.faint(),
            buffer,
        );
        return;
    };
    let title = match lobes.working_depth_mm() {
        Some(depth) => format!(" lobes, ✚ {depth:.2} mm "),
        None => " lobes of the first layer; | speed, no depth set ".into(),
    };
    let inside = framed(&title, palette, area, buffer);
    if inside.height < 3 || inside.width < 8 {
        return;
    }
    let chart = Rect {
        height: inside.height - 1,
        ..inside
    };
    draw_regions(lobes, palette, chart, buffer);
    draw_point(received, lobes, palette, chart, buffer);
    let [from, to] = lobes.rpm;
    let scale = format!(
        "{from:.0} to {to:.0} rev/min, 0 to {:.1} mm; H Hopf  D doubling",
        lobes.depth_mm
    );
    put(inside, inside.height - 1, &scale, palette.faint(), buffer);
}

/// Letters of the unstable regions; `x` where the table holds nothing for this cut.
fn draw_regions(lobes: &LobeMap, palette: Palette, chart: Rect, buffer: &mut Buffer) {
    for x in 0..chart.width {
        let share = (f64::from(x) + 0.5) / f64::from(chart.width);
        let index = (share * COLUMNS as f64) as usize;
        let column = lobes.columns().get(index).and_then(Option::as_ref);
        for y in 0..chart.height {
            let depth = (1.0 - (f64::from(y) + 0.5) / f64::from(chart.height)) * lobes.depth_mm;
            let symbol = match column.map(|column| column.at(Millimeters(depth as f32))) {
                Some(TabulatedStability::Stable { .. }) => ' ',
                Some(TabulatedStability::Unstable { kind, .. }) => letter(kind),
                Some(TabulatedStability::NotKnown(_)) => '?',
                None => 'x',
            };
            if let Some(cell) = buffer.cell_mut((chart.x + x, chart.y + y)) {
                cell.set_char(symbol).set_style(palette.curve());
            }
        }
    }
}

/// The working point at the present speed: a cross, or a line without a depth.
fn draw_point(received: &Received, lobes: &LobeMap, palette: Palette, chart: Rect, buffer: &mut Buffer) {
    let ([from, to], Some(rpm)) = (lobes.rpm, received.rpm()) else {
        return;
    };
    if !(from..=to).contains(&rpm) || to <= from {
        return;
    }
    let x = ((rpm - from) / (to - from) * f64::from(chart.width)) as u16;
    let x = chart.x + x.min(chart.width - 1);
    let row = |depth: f64| {
        let share = (1.0 - depth / lobes.depth_mm).clamp(0.0, 1.0);
        ((share * f64::from(chart.height)) as u16).min(chart.height - 1)
    };
    let (rows, symbol) = match lobes.working_depth_mm() {
        Some(depth) => (row(depth)..row(depth) + 1, '✚'),
        None => (0..chart.height, '|'),
    };
    for y in rows {
        if let Some(cell) = buffer.cell_mut((x, chart.y + y)) {
            cell.set_char(symbol).set_style(palette.mark());
        }
    }
}
