//! What outlives a process, as bytes. One function lists the fields of a type, and saves or restores them, so that the two cannot differ.
//!
//! Numbers lie as in memory, the least byte first; every adapter's host that Abbe runs on has them so. A checksum (CRC-32) over all of it comes last.

use bytemuck::{Pod, Zeroable, bytes_of_mut, cast_slice_mut};
use std::io::{self, Read, Write};

/// Bytes that a list grows by while it is restored: a broken length cannot take all memory.
const STEP: usize = 1 << 22;

/// Saves to a file, or restores from one.
pub struct State<'a> {
    file: File<'a>,
    sum: crc32fast::Hasher,
    position: u64,
}

enum File<'a> {
    Out(&'a mut dyn Write),
    In(&'a mut dyn Read),
}

/// A type whose values outlive a process.
pub trait Persistent {
    /// Hands all its fields to `state`, in an order that never changes.
    ///
    /// # Errors
    /// What reading or writing says; [`io::ErrorKind::InvalidData`] for what no save has written.
    fn persist(&mut self, state: &mut State<'_>) -> io::Result<()>;
}

/// An error for what no save has written.
pub fn invalid(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.into())
}

impl<'a> State<'a> {
    /// Saves to `out`.
    pub fn saving(out: &'a mut dyn Write) -> Self {
        State { file: File::Out(out), sum: crc32fast::Hasher::new(), position: 0 }
    }

    /// Restores from `input`.
    pub fn restoring(input: &'a mut dyn Read) -> Self {
        State { file: File::In(input), sum: crc32fast::Hasher::new(), position: 0 }
    }

    /// A value.
    ///
    /// # Errors
    /// As [`Persistent::persist`].
    pub fn value<T: Pod>(&mut self, value: &mut T) -> io::Result<()> {
        self.bytes(bytes_of_mut(value))
    }

    /// A truth value.
    ///
    /// # Errors
    /// As [`Persistent::persist`].
    pub fn flag(&mut self, flag: &mut bool) -> io::Result<()> {
        let mut byte = u8::from(*flag);
        self.value(&mut byte)?;
        *flag = match byte {
            0 | 1 => byte == 1,
            other => return Err(invalid(format!("{other} in place of a truth value"))),
        };
        Ok(())
    }

    /// A size of something in memory.
    ///
    /// # Errors
    /// As [`Persistent::persist`].
    pub fn size(&mut self, size: &mut usize) -> io::Result<()> {
        let mut wide = *size as u64;
        self.value(&mut wide)?;
        *size = usize::try_from(wide).map_err(|_| invalid(format!("a size of {wide}")))?;
        Ok(())
    }

    /// Values whose number the request decides.
    ///
    /// # Errors
    /// As [`Persistent::persist`]; also for another number of them.
    pub fn slice<T: Pod>(&mut self, values: &mut [T]) -> io::Result<()> {
        let mut count = values.len();
        self.size(&mut count)?;
        if count != values.len() {
            return Err(invalid(format!("{count} values in place of {}", values.len())));
        }
        self.bytes(cast_slice_mut(values))
    }

    /// Values of any number.
    ///
    /// # Errors
    /// As [`Persistent::persist`].
    pub fn list<T: Pod + Zeroable>(&mut self, values: &mut Vec<T>) -> io::Result<()> {
        let mut left = values.len();
        self.size(&mut left)?;
        if matches!(self.file, File::Out(_)) {
            return self.bytes(cast_slice_mut(values));
        }
        values.clear();
        while left > 0 {
            let (from, more) = (values.len(), left.min(STEP / size_of::<T>().max(1)));
            values.resize(from + more, T::zeroed());
            self.bytes(cast_slice_mut(&mut values[from..]))?;
            left -= more;
        }
        Ok(())
    }

    /// Puts bytes that are written elsewhere under the checksum.
    pub fn cover(&mut self, bytes: &[u8]) {
        self.sum.update(bytes);
    }

    /// Bytes so far.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Passes over what is saved up to the checksum, `bytes` of them.
    ///
    /// # Errors
    /// As [`Persistent::persist`].
    pub fn skip(&mut self, bytes: u64) -> io::Result<()> {
        let mut piece = vec![0u8; STEP];
        let mut left = bytes;
        while left > 0 {
            let now = left.min(STEP as u64) as usize;
            self.bytes(&mut piece[..now])?;
            left -= now as u64;
        }
        Ok(())
    }

    /// The checksum, after all else.
    ///
    /// # Errors
    /// As [`Persistent::persist`]; also where the checksum is of other bytes.
    pub fn finish(mut self) -> io::Result<()> {
        let sum = self.sum.clone().finalize();
        let mut found = sum;
        self.value(&mut found)?;
        if found == sum { Ok(()) } else { Err(invalid("its checksum is of other bytes: the file is damaged")) }
    }

    fn bytes(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        match &mut self.file {
            File::Out(out) => out.write_all(bytes)?,
            File::In(input) => input.read_exact(bytes)?,
        }
        self.sum.update(bytes);
        self.position += bytes.len() as u64;
        Ok(())
    }
}

impl State<'_> {
    /// Text.
    ///
    /// # Errors
    /// As [`Persistent::persist`].
    pub fn text(&mut self, text: &mut String) -> io::Result<()> {
        let mut bytes = std::mem::take(text).into_bytes();
        self.list(&mut bytes)?;
        *text = String::from_utf8(bytes).map_err(|_| invalid("text that is none"))?;
        Ok(())
    }
}
