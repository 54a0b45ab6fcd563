//! SVG documents as pixels.

use resvg::{tiny_skia, usvg};

use crate::AnyError;

/// Font families for `sans-serif`; the first installed one is used.
const FAMILIES: [&str; 5] = [
    "DejaVu Sans",
    "Liberation Sans",
    "Noto Sans",
    "Arial",
    "Helvetica",
];

/// An SVG document as a PNG file with `scale` pixels per unit; `None` on a machine without one of these fonts, as its
/// text would be missing.
pub fn png(svg: &str, scale: f32) -> Result<Option<Vec<u8>>, AnyError> {
    let pixels = pixels(svg, scale)?;
    Ok(pixels.map(|it| it.encode_png()).transpose()?)
}

/// An SVG document as pixels, `scale` per unit; `None` on a machine without one of the usual fonts.
pub fn pixels(svg: &str, scale: f32) -> Result<Option<tiny_skia::Pixmap>, AnyError> {
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_system_fonts();
    let there = |family: &&str| {
        let named = |(name, _): &(String, _)| name == family;
        fonts.faces().any(|face| face.families.iter().any(named))
    };
    let Some(family) = FAMILIES.into_iter().find(there) else {
        return Ok(None);
    };
    fonts.set_sans_serif_family(family);
    let tree = usvg::Tree::from_str(svg, &options)?;
    let size = tree.size().to_int_size().scale_by(scale);
    let size = size.ok_or("a picture without size")?;
    let pixels = tiny_skia::Pixmap::new(size.width(), size.height());
    let mut pixels = pixels.ok_or("a picture too large")?;
    let larger = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(&tree, larger, &mut pixels.as_mut());
    Ok(Some(pixels))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_drawn_if_there_is_a_font() -> Result<(), AnyError> {
        let svg = |word: &str| {
            format!(
                "<svg xmlns='http://www.w3.org/2000/svg' width='40' height='20'>\
                 <text x='2' y='15' font-family='sans-serif'>{word}</text></svg>"
            )
        };
        let Some(word) = png(&svg("M"), 2.0)? else {
            println!("no font: nothing drawn");
            return Ok(());
        };
        assert_eq!(&word[1..4], b"PNG");
        assert_eq!(word[16..24], [0, 0, 0, 80, 0, 0, 0, 40], "its size");
        assert_ne!(Some(word), png(&svg(""), 2.0)?);
        Ok(())
    }
}
