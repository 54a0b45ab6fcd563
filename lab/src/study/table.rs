//! Comma-separated tables: comments that start with `#`, a line of names, and rows.

use super::StudyError;
use rapier3d_fields::math::{DQuat, DVec3};

/// A table of comma-separated cells. Cells hold no commas and are not quoted.
#[derive(Clone, Debug)]
pub struct Table<'a> {
    names: Vec<&'a str>,
    rows: Vec<(usize, Vec<&'a str>)>,
}

impl<'a> Table<'a> {
    /// Reads a table.
    ///
    /// # Errors
    /// There is no line of names, or a row has another number of cells.
    pub fn parse(text: &'a str) -> Result<Self, StudyError> {
        let lines = text.lines().enumerate();
        let mut lines = lines.filter(|(_, line)| !line.starts_with('#') && !line.is_empty());
        let Some((_, header)) = lines.next() else {
            let what = "line of names".to_owned();
            return Err(StudyError::Missing { what });
        };
        let names: Vec<&str> = header.split(',').collect();
        let rows: Vec<_> = lines
            .map(|(place, line)| (place + 1, line.split(',').collect::<Vec<_>>()))
            .collect();
        match rows.iter().find(|(_, cells)| cells.len() != names.len()) {
            Some((line, cells)) => Err(StudyError::Missing {
                what: format!(
                    "line {line} of {} cells, but one of {}",
                    names.len(),
                    cells.len()
                ),
            }),
            None => Ok(Table { names, rows }),
        }
    }

    /// The rows from top to bottom.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|(line, cells)| Row {
            names: &self.names,
            line: *line,
            cells,
        })
    }
}

/// A row of a [`Table`], with cells by the names of their columns.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    names: &'a [&'a str],
    line: usize,
    cells: &'a [&'a str],
}

impl<'a> Row<'a> {
    /// The cell in a column.
    ///
    /// # Errors
    /// There is no such column.
    pub fn text(&self, column: &str) -> Result<&'a str, StudyError> {
        let place = self.names.iter().position(|name| *name == column);
        let cell = place.map(|place| self.cells[place]);
        cell.ok_or_else(|| StudyError::Missing {
            what: format!("column `{column}`"),
        })
    }

    /// The cell in a column, parsed by `read`; `expected` names its kind in the error.
    ///
    /// # Errors
    /// There is no such column, or `read` rejects its cell.
    pub fn read<T>(
        &self,
        column: &str,
        expected: &'static str,
        read: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, StudyError> {
        let cell = self.text(column)?;
        read(cell).ok_or_else(|| StudyError::Cell {
            line: self.line,
            column: column.to_owned(),
            cell: cell.to_owned(),
            expected,
        })
    }

    /// The number in a column.
    ///
    /// # Errors
    /// There is no such column, or its cell is not a number.
    pub fn number(&self, column: &str) -> Result<f64, StudyError> {
        self.read(column, "number", |cell| cell.parse().ok())
    }

    /// The three numbers in the columns `prefix`, then x, y or z, then `suffix`.
    ///
    /// # Errors
    /// There is no such column, or a cell is not a number.
    pub fn vector(&self, prefix: &str, suffix: &str) -> Result<DVec3, StudyError> {
        let cell = |axis| self.number(&format!("{prefix}{axis}{suffix}"));
        Ok(DVec3::new(cell("x")?, cell("y")?, cell("z")?))
    }

    /// The rotation in the columns `qw`, `qx`, `qy`, `qz`, normalised.
    ///
    /// # Errors
    /// There is no such column, or a cell is not a number.
    pub fn rotation(&self) -> Result<DQuat, StudyError> {
        let v = self.vector("q", "")?;
        Ok(DQuat::from_xyzw(v.x, v.y, v.z, self.number("qw")?).normalize())
    }
}
