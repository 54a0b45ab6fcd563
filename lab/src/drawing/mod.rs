//! Pictures as SVG, and moving ones as PNG.

#[cfg(feature = "animation")]
pub mod apng;

pub mod arrows;

pub mod picture;

#[cfg(feature = "animation")]
pub mod playground;

pub mod plot;

#[cfg(feature = "png")]
pub mod png;

pub mod projection;

#[cfg(feature = "animation")]
pub mod space;

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
