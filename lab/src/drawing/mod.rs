//! Pictures as SVG.

pub mod arrows;

pub mod picture;

pub mod plot;

#[cfg(feature = "png")]
pub mod png;

pub mod projection;
pub mod work_precision;

/// A picture as a PNG file too, with the feature `png` and on a machine that has one of the usual fonts.
pub fn pixels(svg: &str) -> Result<Option<Vec<u8>>, crate::AnyError> {
    #[cfg(feature = "png")]
    return png::png(svg, 1.0);
    #[cfg(not(feature = "png"))]
    {
        let _ = svg;
        Ok(None)
    }
}
