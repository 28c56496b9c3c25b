//! Plots as SVG.

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

/// Points of one name.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// (x, y); what is not above 0 is drawn at the lower end of the axis.
    pub points: Vec<(f64, f64)>,
    /// Joined by a line, or points alone.
    pub is_line: bool,
}

/// Pixels.
const SIZE: (u32, u32) = (560, 340);

/// Colours that most people can tell apart (Okabe and Ito 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(90, 90, 90),
];

/// Ends of an axis: whole powers of ten around the positive values.
fn decades(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (lo, hi) = values
        .filter(|value| *value > 0.0 && value.is_finite())
        .fold((f64::INFINITY, 0.0_f64), |(lo, hi), value| (lo.min(value), hi.max(value)));
    if lo > hi {
        return (0.1, 10.0);
    }
    let (lo, hi) = (lo.log10().floor(), hi.log10().ceil());
    (10_f64.powf(lo), 10_f64.powf(if hi > lo { hi } else { lo + 1.0 }))
}

/// A number as an axis shows it.
fn label(value: &f64) -> String {
    if (0.01..10_000.0).contains(value) {
        format!("{value}")
    } else {
        format!("{value:.0e}")
    }
}

/// A plot of several series on logarithmic axes, as an `<svg>` element.
pub fn log_log(x_label: &str, y_label: &str, series: &[Series]) -> String {
    let xs = || series.iter().flat_map(|series| series.points.iter().map(|point| point.0));
    let ys = || series.iter().flat_map(|series| series.points.iter().map(|point| point.1));
    let (x, (low, high)) = (decades(xs()), decades(ys()));
    // Room for what is 0.
    let has_zero = ys().any(|y| y <= 0.0);
    let y = (if has_zero { low / 10.0 } else { low }, if series.len() > 3 { high * 10.0 } else { high });
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    // Writing into a string cannot fail.
    let _ =
        draw(&root, (x.0..x.1).log_scale(), (y.0..y.1).log_scale(), (x_label, y_label), series, (x.0, y.0), has_zero);
    drop(root);
    svg
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw<X, Y>(
    root: &Area,
    x: X,
    y: Y,
    labels: (&str, &str),
    series: &[Series],
    least: (f64, f64),
    has_zero: bool,
) -> Result<(), Box<dyn std::error::Error>>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    let mut chart = ChartBuilder::on(root)
        .margin(8)
        .margin_right(26)
        .x_label_area_size(40)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_desc(labels.0)
        .y_desc(labels.1)
        .x_labels(8)
        .y_labels(8)
        .x_label_formatter(&label)
        .y_label_formatter(&|value| if has_zero && *value < least.1 * 1.5 { "0".into() } else { label(value) })
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(215, 215, 215))
        .label_style(("sans-serif", 13))
        .draw()?;
    for (series, color) in series.iter().zip(COLORS.iter().cycle()) {
        let points: Vec<(f64, f64)> = series.points.iter().map(|(x, y)| (x.max(least.0), y.max(least.1))).collect();
        if series.is_line {
            let line = chart.draw_series(LineSeries::new(points.clone(), color.stroke_width(2)))?;
            let stroke = *color;
            line.label(&series.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], stroke.stroke_width(2)));
        }
        let dots = chart.draw_series(points.into_iter().map(|point| Circle::new(point, 3, color.filled())))?;
        if !series.is_line {
            let fill = *color;
            dots.label(&series.name).legend(move |(x, y)| Circle::new((x + 8, y), 3, fill.filled()));
        }
    }
    // The legend stands where the lines are not.
    let ends = series.first().and_then(|series| Some((series.points.first()?, series.points.last()?)));
    let is_rising = ends.is_some_and(|(first, last)| (last.1 - first.1) * (last.0 - first.0) > 0.0);
    if series.len() > 1 {
        chart
            .configure_series_labels()
            .position(if is_rising { SeriesLabelPosition::UpperLeft } else { SeriesLabelPosition::UpperRight })
            .background_style(WHITE.mix(0.8))
            .border_style(RGBColor(200, 200, 200))
            .label_font(("sans-serif", 13))
            .draw()?;
    }
    root.present()?;
    Ok(())
}
