//! Buffers compressed by meshoptimizer: EXT_meshopt_compression and KHR_meshopt_compression, appendices A (bitstreams) and B (filters). Results grow
//! only as data is read, so that they are as large as the data explains: 1,024 bytes for one at most.

/// Elements of a block at most, and bytes of them.
const BLOCK_ELEMENTS: usize = 256;
const BLOCK_BYTES: usize = 8192;
/// Elements of a group, which have deltas of the same width.
const GROUP: usize = 16;

/// What is done to elements after decoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Takes `count` bytes off the front.
fn take<'d>(data: &mut &'d [u8], count: usize) -> Option<&'d [u8]> {
    let (front, rest) = data.split_at_checked(count)?;
    *data = rest;
    Some(front)
}

fn byte(data: &mut &[u8]) -> Option<u8> {
    take(data, 1).map(|b| b[0])
}

/// LEB128, of which bits beyond 32 do not count.
fn varint(data: &mut &[u8]) -> Option<u32> {
    let mut value = 0u32;
    for i in 0..5 {
        let b = byte(data)?;
        value |= u32::from(b & 0x7f) << (7 * i);
        if b & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

/// What a whole number of alternating signs stands for: 0, -1, 1, -2, ...
fn zigzag(v: u32) -> u32 {
    (v >> 1) ^ (v & 1).wrapping_neg()
}

/// Mode ATTRIBUTES: `count` elements of `stride` bytes. `None` if the data is damaged.
pub(super) fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let version = data.first()?.checked_sub(0xa0).filter(|v| *v <= 1)?;
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
        return None;
    }
    let (channels, least) = if version == 1 { (stride / 4, 24) } else { (0, 32) };
    let tail = data.len().checked_sub(stride + channels)?;
    let mut last = data[tail..][..stride].to_vec();
    let modes = &data[tail + stride..];
    let end = data.len().checked_sub((stride + channels).max(least))?;
    let mut body = data.get(1..end)?;
    let most = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_ELEMENTS);
    let mut elements = Vec::new();
    while elements.len() < count * stride {
        let here = (count - elements.len() / stride).min(most);
        let controls = take(&mut body, channels)?;
        let start = elements.len();
        // In version 0 nothing says of how many there are that they are all the same.
        if version == 0 && body.len() < stride * here.div_ceil(4 * GROUP) {
            return None;
        }
        elements.resize(start + here * stride, 0);
        let block = &mut elements[start..];
        for k in 0..stride {
            let control = controls.get(k / 4).map(|c| c >> (2 * (k % 4)) & 3);
            deltas(&mut body, control, block[k..].iter_mut().step_by(stride))?;
        }
        for channel in (0..stride).step_by(4) {
            let mode = modes.get(channel / 4).copied().unwrap_or(0);
            for element in block.chunks_exact_mut(stride) {
                let delta: [u8; 4] = element[channel..channel + 4].try_into().ok()?;
                let before: &mut [u8; 4] = (&mut last[channel..channel + 4]).try_into().ok()?;
                *before = next(mode, *before, delta)?;
                element[channel..channel + 4].copy_from_slice(before);
            }
        }
    }
    body.is_empty().then_some(elements)
}

/// Deltas of one byte of a block's elements.
fn deltas<'e>(body: &mut &[u8], control: Option<u8>, elements: impl ExactSizeIterator<Item = &'e mut u8>) -> Option<()> {
    let widths = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => return Some(()),
        Some(_) => {
            let literal = take(body, elements.len())?;
            elements.zip(literal).for_each(|(e, v)| *e = *v);
            return Some(());
        }
    };
    let groups = elements.len().div_ceil(GROUP);
    let headers = take(body, groups.div_ceil(4))?;
    let mut group = [0; GROUP];
    for (i, element) in elements.enumerate() {
        if i % GROUP == 0 {
            let g = i / GROUP;
            group = deltas_of_group(body, widths[usize::from(headers[g / 4] >> (2 * (g % 4)) & 3)])?;
        }
        *element = group[i % GROUP];
    }
    Some(())
}

/// Deltas of a group, of so many bits each; those that do not fit follow as bytes.
fn deltas_of_group(body: &mut &[u8], width: usize) -> Option<[u8; GROUP]> {
    if width == 0 {
        return Some([0; GROUP]);
    }
    let packed = take(body, 2 * width)?;
    if width == 8 {
        return packed.try_into().ok();
    }
    let (in_byte, sentinel) = (8 / width, (1u8 << width) - 1);
    let mut group = [0; GROUP];
    for (i, delta) in group.iter_mut().enumerate() {
        let place = if width == 1 { i % 8 } else { (in_byte - 1 - i % in_byte) * width };
        let code = packed[i / in_byte] >> place & sentinel;
        *delta = if code == sentinel { byte(body)? } else { code };
    }
    Some(group)
}

/// Four bytes of an element from those of the one before and their delta.
fn next(mode: u8, before: [u8; 4], delta: [u8; 4]) -> Option<[u8; 4]> {
    match mode {
        0 => Some(std::array::from_fn(|i| before[i].wrapping_add(zigzag(u32::from(delta[i])) as u8))),
        1 => {
            let half = |bytes: [u8; 4], i: usize| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]);
            let [a, b] =
                [0, 1].map(|i| half(before, i).wrapping_add(zigzag(u32::from(half(delta, i))) as u16)).map(u16::to_le_bytes);
            Some([a[0], a[1], b[0], b[1]])
        }
        _ if mode & 15 == 2 => {
            let turned = u32::from_le_bytes(delta).rotate_right(u32::from(mode >> 4));
            Some((u32::from_le_bytes(before) ^ turned).to_le_bytes())
        }
        _ => None,
    }
}

/// The 16 edges and vertices that came last.
struct Recent<T> {
    items: [Option<T>; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new() -> Self {
        Recent { items: [None; 16], next: 0 }
    }

    fn push(&mut self, item: T) {
        self.items[self.next] = Some(item);
        self.next = (self.next + 1) % 16;
    }

    /// The one that so many came after.
    fn back(&self, i: usize) -> Option<T> {
        self.items[(self.next + 15 - i) % 16]
    }
}

/// Mode TRIANGLES: `count` indices of `stride` bytes, three for each triangle. `None` if the data is damaged.
pub(super) fn triangles(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let mut body = data.get(..data.len().checked_sub(16)?)?;
    let table = &data[body.len()..];
    if byte(&mut body)? != 0xe1 || !count.is_multiple_of(3) {
        return None;
    }
    let codes = take(&mut body, count / 3)?;
    let (mut edges, mut vertices) = (Recent::<(u32, u32)>::new(), Recent::<u32>::new());
    let (mut unseen, mut last) = (0u32, 0u32);
    let fresh = |unseen: &mut u32| std::mem::replace(unseen, unseen.wrapping_add(1));
    let explicit = |body: &mut &[u8], last: &mut u32| {
        *last = last.wrapping_add(zigzag(varint(body)?));
        Some(*last)
    };
    let mut indices = Vec::with_capacity(count * stride);
    for code in codes {
        let (x, y) = (usize::from(code >> 4), usize::from(code & 15));
        let [a, b, c] = if x < 15 {
            let (a, b) = edges.back(x)?;
            let c = match y {
                0 => fresh(&mut unseen),
                1..13 => vertices.back(y)?,
                13 | 14 => {
                    last = if y == 13 { last.wrapping_sub(1) } else { last.wrapping_add(1) };
                    last
                }
                _ => explicit(&mut body, &mut last)?,
            };
            edges.push((c, b));
            edges.push((a, c));
            if !(1..13).contains(&y) {
                vertices.push(c);
            }
            [a, b, c]
        } else {
            let places = if y < 14 { table[y] } else { byte(&mut body)? };
            if y >= 14 && places == 0 {
                unseen = 0;
            }
            let a = if y < 15 { fresh(&mut unseen) } else { explicit(&mut body, &mut last)? };
            let mut other = |place: usize| match place {
                0 => Some(fresh(&mut unseen)),
                15 => explicit(&mut body, &mut last),
                _ => vertices.back(place - 1),
            };
            let (z, w) = (usize::from(places >> 4), usize::from(places & 15));
            let (b, c) = (other(z)?, other(w)?);
            edges.push((b, a));
            edges.push((c, b));
            edges.push((a, c));
            vertices.push(a);
            for (place, vertex) in [(z, b), (w, c)] {
                if place == 0 || place == 15 {
                    vertices.push(vertex);
                }
            }
            [a, b, c]
        };
        [a, b, c].iter().for_each(|i| indices.extend(&i.to_le_bytes()[..stride]));
    }
    body.is_empty().then_some(indices)
}

/// Mode INDICES: `count` indices of `stride` bytes. `None` if the data is damaged.
pub(super) fn indices(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let mut body = data.get(..data.len().checked_sub(4)?)?;
    if byte(&mut body)? != 0xd1 {
        return None;
    }
    let mut last = [0u32; 2];
    let mut indices = Vec::new();
    for _ in 0..count {
        let v = varint(&mut body)?;
        let last = &mut last[(v & 1) as usize];
        *last = last.wrapping_add(zigzag(v >> 1));
        indices.extend(&last.to_le_bytes()[..stride]);
    }
    body.is_empty().then_some(indices)
}

impl Filter {
    /// May elements of `stride` bytes have it?
    pub(super) fn fits(self, stride: usize) -> bool {
        match self {
            Filter::None | Filter::Exponential => true,
            Filter::Octahedral | Filter::Color => stride == 4 || stride == 8,
            Filter::Quaternion => stride == 8,
        }
    }

    /// Undoes it on elements of `stride` bytes.
    pub(super) fn undo(self, elements: &mut [u8], stride: usize) {
        match self {
            Filter::None => {}
            Filter::Exponential => {
                for number in elements.as_chunks_mut::<4>().0 {
                    let v = i32::from_le_bytes(*number);
                    *number = (((v << 8) >> 8) as f32 * f32::exp2((v >> 24) as f32)).to_le_bytes();
                }
            }
            _ if stride == 4 => {
                for element in elements.as_chunks_mut::<4>().0 {
                    let (unsigned, signed) = (element.map(i32::from), element.map(|v| i32::from(v as i8)));
                    let undone = match self {
                        Filter::Color => color([unsigned[0], signed[1], signed[2], unsigned[3]], 255.0),
                        _ => octahedral(signed, 127.0),
                    };
                    *element = undone.map(|v| v as u8);
                }
            }
            _ => {
                for element in elements.as_chunks_mut::<8>().0 {
                    let words: [u16; 4] = std::array::from_fn(|i| u16::from_le_bytes([element[2 * i], element[2 * i + 1]]));
                    let signed = words.map(|v| i32::from(v as i16));
                    let undone = match self {
                        Filter::Color => color([i32::from(words[0]), signed[1], signed[2], i32::from(words[3])], 65535.0),
                        Filter::Quaternion => quaternion(signed),
                        _ => octahedral(signed, 32767.0),
                    };
                    for (bytes, v) in element.as_chunks_mut::<2>().0.iter_mut().zip(undone) {
                        *bytes = (v as u16).to_le_bytes();
                    }
                }
            }
        }
    }
}

/// A unit vector in an octahedron's net (Cigolle et al. 2014), of which `[2]` is what stands for 1.
fn octahedral(v: [i32; 4], most: f32) -> [i32; 4] {
    let [x, y] = [v[0], v[1]].map(|c| c as f32 / v[2] as f32);
    let z = 1.0 - x.abs() - y.abs();
    let [x, y] = [x, y].map(|c| c - z.min(0.0).copysign(c));
    let length = (x * x + y * y + z * z).sqrt();
    let [x, y, z] = [x, y, z].map(|c| (c / length * most).round() as i32);
    [x, y, z, v[3]]
}

/// A unit quaternion but for its greatest component, which the last two bits of `[3]` name; the rest of that stands for 1.
fn quaternion(v: [i32; 4]) -> [i32; 4] {
    let one = (v[3] | 3) as f32;
    let parts = [v[0], v[1], v[2]].map(|c| c as f32 / one * std::f32::consts::FRAC_1_SQRT_2);
    let greatest = (1.0 - parts.iter().map(|c| c * c).sum::<f32>()).max(0.0).sqrt();
    let mut q = [0; 4];
    for (i, c) in [greatest, parts[0], parts[1], parts[2]].into_iter().enumerate() {
        q[((v[3] & 3) as usize + i) % 4] = (c * 32767.0).round() as i32;
    }
    q
}

/// Red, green, blue and alpha of YCoCg, of as many bits as alpha's first bit says.
fn color([y, co, cg, a]: [i32; 4], most: f32) -> [i32; 4] {
    let scale = (2i32 << a.max(1).ilog2()) - 1;
    let alpha = a & scale >> 1;
    let alpha = alpha << 1 | alpha & 1;
    [y + co - cg, y + cg, y - co - cg, alpha].map(|v| (v as f32 * (most / scale as f32)).round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use base64::engine::general_purpose::STANDARD;
    use serde_json::Value;

    /// meshoptimizer's own decoder (its head says how), whose filters are exact to a unit.
    #[test]
    fn streams_are_decoded_as_meshoptimizer_does() {
        let cases: Value = serde_json::from_str(include_str!("../../../tests/data/meshopt.json")).unwrap();
        for case in cases["cases"].as_array().unwrap() {
            let bytes = |key: &str| STANDARD.decode(case[key].as_str().unwrap()).unwrap();
            let [count, stride] = ["count", "stride"].map(|key| case[key].as_u64().unwrap() as usize);
            let (data, right) = (bytes("data"), bytes("decoded"));
            let (filter, mode) = (case["filter"].as_str().unwrap(), case["mode"].as_str().unwrap());
            let decode = |data: &[u8]| match mode {
                "ATTRIBUTES" => attributes(data, count, stride),
                "TRIANGLES" => triangles(data, count, stride),
                _ => indices(data, count, stride),
            };
            let mut decoded = decode(&data).unwrap_or_else(|| panic!("{case}"));
            let filter = match filter {
                "OCTAHEDRAL" => Filter::Octahedral,
                "QUATERNION" => Filter::Quaternion,
                "EXPONENTIAL" => Filter::Exponential,
                "COLOR" => Filter::Color,
                _ => Filter::None,
            };
            filter.undo(&mut decoded, stride);
            let numbers = |bytes: &[u8]| -> Vec<i32> {
                match (filter, stride) {
                    (Filter::None | Filter::Exponential, _) => bytes.iter().map(|b| i32::from(*b)).collect(),
                    (Filter::Color, 4) => bytes.iter().map(|b| i32::from(*b)).collect(),
                    (_, 4) => bytes.iter().map(|b| i32::from(*b as i8)).collect(),
                    (Filter::Color, _) => bytes.as_chunks().0.iter().map(|b| i32::from(u16::from_le_bytes(*b))).collect(),
                    _ => bytes.as_chunks().0.iter().map(|b| i32::from(i16::from_le_bytes(*b))).collect(),
                }
            };
            let slack = i32::from(!matches!(filter, Filter::None | Filter::Exponential));
            let (decoded, right) = (numbers(&decoded), numbers(&right));
            assert_eq!(decoded.len(), right.len(), "{case}");
            assert!(decoded.iter().zip(&right).all(|(a, b)| (a - b).abs() <= slack), "{case}: {decoded:?} is to be {right:?}");
            // Data that is left over is damage.
            let longer = [&data[..1], &[0], &data[1..]].concat();
            assert!(decode(&longer).is_none() || mode == "ATTRIBUTES", "{case}");
        }
    }
}
