//! Pictures as SVG, and animated ones as PNG.

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

/// An SVG picture as a PNG file; `None` without the feature `png`, or on a machine without one of the usual fonts.
pub fn pixels(svg: &str) -> Result<Option<Vec<u8>>, crate::AnyError> {
    #[cfg(feature = "png")]
    return png::png(svg, 1.0);
    #[cfg(not(feature = "png"))]
    {
        let _ = svg;
        Ok(None)
    }
}
