//! A stroke font for labels: each glyph a few lines on a grid of 5 × 9 points.

use tiny_skia::{Color, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Stroke, Transform};

/// Distance of two points of the grid, in pixels.
const STEP: f32 = 1.35;

/// Lines of a glyph, separated by a bar, as points of a column (0 to 4) and a row (0 to 8; 2 is the top of
/// small letters, 6 the base line).
const GLYPHS: [(char, &str); 38] = [
    ('a', "42 46|43 32 12 03 05 16 36 45"),
    ('b', "00 06|03 12 32 43 45 36 16 05"),
    ('c', "43 32 12 03 05 16 36 45"),
    ('d', "40 46|43 32 12 03 05 16 36 45"),
    ('e', "04 44 43 32 12 03 05 16 36 45"),
    ('f', "30 20 11 16|02 32"),
    ('g', "42 47 38 18 07|43 32 12 03 05 16 36 45"),
    ('h', "00 06|03 12 32 43 46"),
    ('i', "22 26|20 20"),
    ('j', "22 27 18|20 20"),
    ('k', "00 06|42 04|14 46"),
    ('l', "20 26"),
    ('m', "02 06|03 12 23 26|23 32 43 46"),
    ('n', "02 06|03 12 32 43 46"),
    ('o', "12 32 43 45 36 16 05 03 12"),
    ('p', "02 08|03 12 32 43 45 36 16 05"),
    ('q', "42 48|43 32 12 03 05 16 36 45"),
    ('r', "02 06|04 13 22 32"),
    ('s', "43 32 12 03 14 34 45 36 16 05"),
    ('t', "10 15 26 36|02 32"),
    ('u', "02 05 16 36 45|42 46"),
    ('v', "02 26 42"),
    ('w', "02 16 23 36 42"),
    ('x', "02 46|42 06"),
    ('y', "02 25|42 18"),
    ('z', "02 42 06 46"),
    ('0', "10 30 41 45 36 16 05 01 10"),
    ('1', "11 20 26"),
    ('2', "01 10 30 41 42 06 46"),
    ('3', "01 10 30 41 42 33 44 45 36 16 05|13 33"),
    ('4', "30 04 44|30 36"),
    ('5', "40 00 02 32 43 45 36 16 05"),
    ('6', "30 10 01 05 16 36 45 43 32 12 03"),
    ('7', "00 40 16"),
    ('8', "13 02 01 10 30 41 42 33 13 04 05 16 36 45 44 33"),
    ('9', "43 34 14 03 01 10 30 41 45 36 16"),
    ('.', "26 26"),
    ('-', "04 44"),
];

/// Writes `text` with its upper left corner at (`x`, `y`); what has no glyph is left blank.
pub(super) fn draw(target: &mut Pixmap, text: &str, mut x: f32, y: f32) {
    let mut paint = Paint::default();
    paint.set_color(Color::from_rgba8(220, 220, 225, 255));
    let stroke =
        Stroke { width: 1.2, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
    for letter in text.chars() {
        let strokes = GLYPHS.iter().find(|(glyph, _)| *glyph == letter.to_ascii_lowercase());
        if let Some((_, lines)) = strokes {
            let mut path = PathBuilder::new();
            for line in lines.split('|') {
                for (index, point) in line.split(' ').enumerate() {
                    let at = |digit: usize| f32::from(point.as_bytes()[digit] - b'0') * STEP;
                    let (px, py) = (x + at(0), y + at(1));
                    // A dot is a line of no length; its caps make it round.
                    if index == 0 { path.move_to(px, py) } else { path.line_to(px, py + 1e-3) }
                }
            }
            if let Some(path) = path.finish() {
                target.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
            }
        }
        x += 6.0 * STEP;
    }
}
