//! The spectrum as bars, with harmonics of the spindle and the chatter frequency marked below them.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::frame::{band_name, framed, put};
use super::palette::Palette;
use crate::monitor::choices::Choices;
use crate::monitor::received::Received;

/// Range of the bars below the largest one, dB: a choice; weaker lines are no cause of a verdict.
const RANGE_DB: f64 = 50.0;

/// Bars of one to eight eighths of a cell.
const EIGHTHS: [&str; 9] = [" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"];

/// Draws the spectrum of the chosen band.
pub(super) fn draw(
    received: &Received,
    choices: &Choices,
    palette: Palette,
    area: Rect,
    buffer: &mut Buffer,
) {
    let spectrum = received.spectrum(choices.band);
    let band = band_name(choices.band);
    let title = format!(" spectrum, {band}, top {} ", peak_text(&spectrum.power));
    let inside = framed(&title, palette, area, buffer);
    if inside.height < 3 || inside.width < 8 {
        return;
    }
    if spectrum.power.is_empty() {
        put(inside, 0, "no spectrum yet", palette.faint(), buffer);
        return;
    }
    let end_hz = end_hz(received, choices);
    let bars = Rect {
        height: inside.height - 2,
        ..inside
    };
    draw_bars(
        &spectrum.columns(usize::from(bars.width), end_hz),
        palette,
        bars,
        buffer,
    );
    draw_marks(received, end_hz, palette, inside, buffer);
    draw_scale(received, end_hz, palette, inside, buffer);
}

/// Amplitude of the largest bin as text.
fn peak_text(power: &[f32]) -> String {
    let top = power.iter().copied().fold(0.0_f32, f32::max);
    format!("{:.3} m/s²", top.sqrt())
}

/// End of the frequency scale, Hz: as chosen by zoom, else as fitted to speed and chatter.
fn end_hz(received: &Received, choices: &Choices) -> f64 {
    match choices.zoom {
        Some(zoom) => received.spectrum(choices.band).end_hz() / f64::from(1_u32 << zoom),
        None => received.fitted_end_hz(choices.band),
    }
}

fn draw_bars(power: &[f32], palette: Palette, area: Rect, buffer: &mut Buffer) {
    let top = f64::from(power.iter().copied().fold(f32::MIN_POSITIVE, f32::max));
    let eighths = f64::from(area.height) * 8.0;
    for (x, &power) in (area.x..area.right()).zip(power) {
        let below_db = 10.0 * (f64::from(power).max(f64::MIN_POSITIVE) / top).log10();
        let height = ((1.0 + below_db / RANGE_DB).max(0.0) * eighths).round() as usize;
        for row in 0..usize::from(area.height) {
            let filled = height.saturating_sub(8 * row).min(8);
            let y = area.bottom() - 1 - row as u16;
            if let (Some(cell), Some(symbol)) = (buffer.cell_mut((x, y)), EIGHTHS.get(filled)) {
                cell.set_symbol(symbol).set_style(palette.curve());
            }
        }
    }
}

/// Marks below the bars: `T` a harmonic of the tooth passing, `·` one of the spindle, `▲` the chatter frequency.
fn draw_marks(received: &Received, end_hz: f64, palette: Palette, inside: Rect, buffer: &mut Buffer) {
    let width_hz = end_hz / f64::from(inside.width);
    let y = inside.bottom() - 2;
    let holds = |column: u16, step_hz: f64| {
        let from = f64::from(column) * width_hz;
        let harmonic = (from / step_hz).ceil().max(1.0) * step_hz;
        harmonic < from + width_hz
    };
    let spindle = received.rpm().map(|rpm| rpm / 60.0);
    for column in 0..inside.width {
        let is_chatter = received
            .chatter_hz()
            .is_some_and(|chatter| (chatter / width_hz) as u16 == column);
        // Harmonics closer together than three columns are a bar that marks nothing.
        let is_of = |step: Option<f64>| step.is_some_and(|hz| hz > 3.0 * width_hz && holds(column, hz));
        let (mark, style) = if is_chatter {
            ("▲", palette.mark())
        } else if is_of(received.tooth_hz()) {
            ("T", palette.title())
        } else if is_of(spindle) {
            ("·", palette.faint())
        } else {
            continue;
        };
        if let Some(cell) = buffer.cell_mut((inside.x + column, y)) {
            cell.set_symbol(mark).set_style(style);
        }
    }
}

/// Ends of the frequency scale, and between them the meaning of the marks.
fn draw_scale(received: &Received, end_hz: f64, palette: Palette, inside: Rect, buffer: &mut Buffer) {
    let row = inside.height - 1;
    let end = format!("{end_hz:.0} Hz");
    let legend = match received.chatter_hz() {
        Some(chatter) => format!("0   ▲ chatter {chatter:.1} Hz  T tooth  · spindle"),
        None => "0   T tooth passing  · spindle".into(),
    };
    put(inside, row, &legend, palette.faint(), buffer);
    let width = end.chars().count() as u16;
    let right = Rect {
        x: inside.right().saturating_sub(width + 1).max(inside.x),
        width: (width + 1).min(inside.width),
        ..inside
    };
    put(right, row, &format!(" {end}"), palette.faint(), buffer);
}
