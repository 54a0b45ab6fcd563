//! Animated PNG files of small size.

use color_quant::NeuQuant;
use png::{BitDepth, BlendOp, ColorType, Compression, Encoder, Filter};

use crate::AnyError;

/// A pixel: red, green, blue and opacity.
pub type Pixel = [u8; 4];

/// The number of the transparent colour, which keeps a pixel of the frame before.
const UNCHANGED: u8 = 255;
/// A pixel is kept if no part of its colour differs by more.
const TOLERANCE: u8 = 3;
/// The palette is chosen from one in this many pixels.
const SPARSE: usize = 37;

/// A sequence of pictures of one size.
pub struct Film {
    pub size: [usize; 2],
    pub frames_per_second: u16,
    pub frames: Vec<Vec<Pixel>>,
}

/// The rectangle of a picture that differs from the one before.
#[derive(Debug, PartialEq)]
struct Change {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

impl Film {
    /// The film as an animated PNG file of 255 colours that repeats without end.
    ///
    /// # Errors
    /// There is no picture, or their size is not `size`.
    pub fn encode(&self) -> Result<Vec<u8>, AnyError> {
        let palette = Palette::of(self);
        let mut frames: Vec<Vec<u8>> = Vec::new();
        for frame in &self.frames {
            let numbers = palette.numbers(frame, frames.last());
            frames.push(numbers);
        }
        let mut file = Vec::new();
        let [width, height] = self.size.map(|it| it as u32);
        let mut encoder = Encoder::new(&mut file, width, height);
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_palette(palette.colors());
        encoder.set_trns(palette.opacities());
        encoder.set_compression(Compression::High);
        encoder.set_filter(Filter::NoFilter);
        encoder.set_animated(frames.len() as u32, 0)?;
        encoder.set_frame_delay(1, self.frames_per_second)?;
        let mut writer = encoder.write_header()?;
        let first = frames.first().ok_or("a film without pictures")?;
        writer.write_image_data(first)?;
        writer.set_blend_op(BlendOp::Over)?;
        for pair in frames.windows(2) {
            let change = Change::between(&pair[0], &pair[1], self.size[0]);
            writer.reset_frame_position()?;
            writer.set_frame_dimension(change.width as u32, change.height as u32)?;
            writer.set_frame_position(change.left as u32, change.top as u32)?;
            writer.write_image_data(&change.cut(&pair[0], &pair[1], self.size[0]))?;
        }
        writer.finish()?;
        Ok(file)
    }
}

impl Change {
    /// The smallest rectangle with all changes; a single pixel if there is none.
    fn between(before: &[u8], after: &[u8], width: usize) -> Self {
        let height = before.len() / width;
        let rows = before.chunks(width).zip(after.chunks(width));
        let (mut lines, mut columns) = (height..0, width..0);
        for (row, (before, after)) in rows.enumerate().filter(|(_, (a, b))| a != b) {
            let differs = |column: &usize| before[*column] != after[*column];
            let first = (0..width).find(differs).unwrap_or(0);
            let last = (0..width).rfind(differs).unwrap_or(0);
            lines = lines.start.min(row)..row + 1;
            columns = columns.start.min(first)..columns.end.max(last + 1);
        }
        if lines.is_empty() {
            (lines, columns) = (0..1, 0..1);
        }
        Self {
            left: columns.start,
            top: lines.start,
            width: columns.len(),
            height: lines.len(),
        }
    }

    /// The new content of the rectangle; [`UNCHANGED`] where it equals the old.
    fn cut(&self, before: &[u8], after: &[u8], width: usize) -> Vec<u8> {
        let mut cut = Vec::with_capacity(self.width * self.height);
        for row in self.top..self.top + self.height {
            let start = row * width + self.left;
            let places = start..start + self.width;
            cut.extend(places.map(|place| match before[place] == after[place] {
                true => UNCHANGED,
                false => after[place],
            }));
        }
        cut
    }
}

/// The colours of a film.
struct Palette {
    colors: Vec<Pixel>,
    nearest: NeuQuant,
}

impl Palette {
    fn of(film: &Film) -> Self {
        let pixels = film.frames.iter().flatten().step_by(SPARSE);
        let pixels: Vec<u8> = pixels.flatten().copied().collect();
        let nearest = NeuQuant::new(1, usize::from(UNCHANGED), &pixels);
        let colors = nearest.color_map_rgba();
        let mut colors: Vec<Pixel> = colors
            .chunks(4)
            .map(|it| std::array::from_fn(|k| it[k]))
            .collect();
        colors.push([0; 4]);
        Self { colors, nearest }
    }

    /// The numbers of the colours of a frame; those of the frame before where they are near enough.
    fn numbers(&self, frame: &[Pixel], before: Option<&Vec<u8>>) -> Vec<u8> {
        let near = |pixel: &Pixel, number: u8| {
            let color = self.colors[usize::from(number)];
            (0..4).all(|k| pixel[k].abs_diff(color[k]) <= TOLERANCE)
        };
        // A lookup is slow, and neighbours are often equal.
        let mut last = (Pixel::default(), self.number(&Pixel::default()));
        let mut number = |pixel: &Pixel| {
            if *pixel != last.0 {
                last = (*pixel, self.number(pixel));
            }
            last.1
        };
        let kept = |place: usize| before.map(|it| it[place]);
        let pixels = frame.iter().enumerate();
        let numbers = pixels.map(|(place, pixel)| match kept(place) {
            Some(had) if near(pixel, had) => had,
            _ => number(pixel),
        });
        numbers.collect()
    }

    fn number(&self, pixel: &Pixel) -> u8 {
        self.nearest.index_of(pixel) as u8
    }

    fn colors(&self) -> Vec<u8> {
        self.colors
            .iter()
            .flat_map(|it| [it[0], it[1], it[2]])
            .collect()
    }

    fn opacities(&self) -> Vec<u8> {
        self.colors.iter().map(|it| it[3]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [40, 30];
    const GREY: Pixel = [90, 90, 90, 255];
    const RED: Pixel = [220, 20, 20, 255];

    /// A red square that moves to the right over grey by a pixel per frame.
    fn film() -> Film {
        let frame = |left: usize| {
            let pixels = (0..SIZE[0] * SIZE[1]).map(|k| [k % SIZE[0], k / SIZE[0]]);
            let inside =
                |[x, y]: [usize; 2]| (left..left + 20).contains(&x) && (5..25).contains(&y);
            pixels
                .map(|it| if inside(it) { RED } else { GREY })
                .collect()
        };
        Film {
            size: SIZE,
            frames_per_second: 25,
            frames: (0..10).map(frame).collect(),
        }
    }

    /// The largest difference of two colours in one of their parts.
    fn off(a: &[u8], b: &Pixel) -> u8 {
        let parts = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b));
        parts.max().unwrap_or(u8::MAX)
    }

    #[test]
    fn decoded_pictures_equal_those_of_the_film() -> Result<(), AnyError> {
        let film = film();
        let file = film.encode()?;
        let mut decoder = png::Decoder::new(std::io::Cursor::new(&file));
        decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::ALPHA);
        let mut reader = decoder.read_info()?;
        let mut page = vec![Pixel::default(); SIZE[0] * SIZE[1]];
        let mut part = vec![0; 4 * page.len()];
        for frame in &film.frames {
            reader.next_frame(&mut part)?;
            let control = *reader
                .info()
                .frame_control()
                .ok_or("not a moving picture")?;
            let [left, top] = [control.x_offset, control.y_offset].map(|it| it as usize);
            for (k, pixel) in part
                .chunks(4)
                .take((control.width * control.height) as usize)
                .enumerate()
            {
                let place = (top + k / control.width as usize) * SIZE[0]
                    + left
                    + k % control.width as usize;
                if pixel[3] > 0 {
                    page[place].copy_from_slice(pixel);
                }
            }
            let worst = page.iter().zip(frame).map(|(a, b)| off(a, b)).max();
            assert!(worst < Some(16), "{worst:?} of 255");
        }
        Ok(())
    }

    #[test]
    fn only_changed_pixels_are_stored() {
        let numbers = |left: usize| {
            let frame = &film().frames[left];
            frame
                .iter()
                .map(|it| u8::from(*it == RED))
                .collect::<Vec<_>>()
        };
        let change = Change::between(&numbers(2), &numbers(3), SIZE[0]);
        assert_eq!(
            change,
            Change {
                left: 2,
                top: 5,
                width: 21,
                height: 20
            }
        );
        let cut = change.cut(&numbers(2), &numbers(3), SIZE[0]);
        let changed = cut.iter().filter(|it| **it != UNCHANGED).count();
        assert_eq!(changed, 40, "a column is left, and one is reached");
        let still = Change::between(&numbers(2), &numbers(2), SIZE[0]);
        assert_eq!((still.width, still.height), (1, 1));
    }
}
