//! Numbers in buffers: the `gltf` crate's accessors, whose sizes are checked before they are believed.

use crate::error::{Result, quoted};
use crate::scene::gltf::document::{Asset, element};
use crate::scene::json::Node;
use gltf::Accessor;
use gltf::accessor::sparse::{IndexType, Sparse};
use gltf::accessor::util::ItemIter;
use gltf::accessor::{DataType, Dimensions, Item, Iter};
use std::mem::size_of;

/// Elements of an accessor without data, which is zeros, at most: nothing in the file's size accounts for them.
const MOST_ZEROS: usize = 1 << 20;

/// An element of `N` components, which for matrices go column by column.
#[derive(Clone, Copy)]
struct Element<T, const N: usize>([T; N]);

impl<T: Item + Copy, const N: usize> Item for Element<T, N> {
    fn from_slice(slice: &[u8]) -> Self {
        Element(std::array::from_fn(|i| T::from_slice(&slice[i * size_of::<T>()..])))
    }

    fn zero() -> Self {
        Element([T::zero(); N])
    }
}

impl Asset {
    /// The numbers of an accessor of `N` components, normalised integers as the fractions they stand for.
    pub(in crate::scene) fn numbers<const N: usize>(&self, root: &Node, accessor: &Accessor) -> Result<Vec<[f64; N]>> {
        let node = element(root, "accessors", accessor.index())?;
        let wanted = [Dimensions::Scalar, Dimensions::Vec2, Dimensions::Vec3, Dimensions::Vec4, Dimensions::Mat4];
        let fits = |d: &Dimensions| d.multiplicity() == N && *d == accessor.dimensions();
        if !wanted.iter().any(fits) {
            let (kind, names) = (node.need("type")?, ["SCALAR", "VEC2", "VEC3", "VEC4"]);
            let name = names.get(N - 1).unwrap_or(&"MAT4");
            return Err(kind.fail(format!("{} where {name} is needed", quoted(kind.string()?)), "export the file again"));
        }
        let signed = |v: f64, largest: f64| if accessor.normalized() { (v * (1.0 / largest)).max(-1.0) } else { v };
        match accessor.data_type() {
            DataType::I8 => self.read(root, &node, accessor, |v: i8| signed(f64::from(v), 127.0)),
            DataType::U8 => self.read(root, &node, accessor, |v: u8| signed(f64::from(v), 255.0)),
            DataType::I16 => self.read(root, &node, accessor, |v: i16| signed(f64::from(v), 32767.0)),
            DataType::U16 => self.read(root, &node, accessor, |v: u16| signed(f64::from(v), 65535.0)),
            DataType::U32 => self.read(root, &node, accessor, |v: u32| f64::from(v)),
            DataType::F32 => self.read(root, &node, accessor, |v: f32| f64::from(v)),
        }
    }

    /// The whole numbers of an accessor of one component.
    pub(in crate::scene) fn indices(&self, root: &Node, accessor: &Accessor) -> Result<Vec<u32>> {
        let node = element(root, "accessors", accessor.index())?;
        let kind = node.need("type")?;
        if accessor.dimensions() != Dimensions::Scalar {
            return Err(kind.fail(format!("{} where SCALAR is needed", quoted(kind.string()?)), "export the file again"));
        }
        let whole = |[v]: [u32; 1]| v;
        Ok(match accessor.data_type() {
            DataType::U8 => self.read(root, &node, accessor, |v: u8| u32::from(v))?.into_iter().map(whole).collect(),
            DataType::U16 => self.read(root, &node, accessor, |v: u16| u32::from(v))?.into_iter().map(whole).collect(),
            DataType::U32 => self.read(root, &node, accessor, |v: u32| v)?.into_iter().map(whole).collect(),
            _ => return Err(node.need("componentType")?.fail("indices of this type", "export the file again")),
        })
    }

    fn read<T: Item + Copy, U: Clone, const N: usize>(
        &self,
        root: &Node,
        node: &Node,
        accessor: &Accessor,
        number: impl Fn(T) -> U,
    ) -> Result<Vec<[U; N]>> {
        let (size, count) = (size_of::<Element<T, N>>(), accessor.count());
        let of_element = |e: Element<T, N>| e.0.map(&number);
        match accessor.view() {
            Some(view) => self.check_span(root, node, &view, (accessor.offset(), size, count)).map(|_| ())?,
            None if count > MOST_ZEROS => {
                let problem = format!("an accessor of {count} zeros: nothing in the file accounts for so many");
                return Err(node.fail(problem, "export it with its data"));
            }
            None => {}
        }
        match accessor.sparse() {
            Some(sparse) => self.check_sparse(root, &node.need("sparse")?, &sparse, (size, count))?,
            None if accessor.view().is_none() => return Ok(vec![of_element(Element::zero()); count]),
            None => {}
        }
        let elements = Iter::new(accessor.clone(), |buffer| self.buffer(&buffer));
        let elements = elements.ok_or_else(|| node.fail("the accessor has no data", "export the file again"))?;
        Ok(elements.map(of_element).collect())
    }

    /// The bytes of `count` elements of `size` bytes from `offset` of a view, as far apart as it says; `node` asks for them.
    fn check_span(
        &self,
        root: &Node,
        node: &Node,
        view: &gltf::buffer::View,
        (offset, size, count): (usize, usize, usize),
    ) -> Result<(&[u8], usize)> {
        let bytes = self.view(root, view)?;
        let stride = view.stride().unwrap_or(size);
        if stride < size {
            let view = element(root, "bufferViews", view.index())?;
            return Err(view.fail(format!("elements of {size} bytes every {stride}"), "export the file again"));
        }
        let end = count.checked_sub(1).and_then(|last| last.checked_mul(stride)?.checked_add(offset)?.checked_add(size));
        let span = end.and_then(|end| bytes.get(offset..end));
        let span = span.ok_or_else(|| node.fail("the accessor reaches beyond its buffer", "export the file again"))?;
        Ok((span, stride))
    }

    /// Checks the sparse values of an accessor of `count` elements of `size` bytes: the crate takes their places to rise.
    fn check_sparse(&self, root: &Node, node: &Node, sparse: &Sparse, (size, count): (usize, usize)) -> Result<()> {
        let (indices, values) = (sparse.indices(), sparse.values());
        self.check_span(root, &node.need("values")?, &values.view(), (values.offset(), size, sparse.count()))?;
        let node = node.need("indices")?;
        let span = (indices.offset(), indices.index_type().size(), sparse.count());
        let (bytes, stride) = self.check_span(root, &node, &indices.view(), span)?;
        let places: Vec<u32> = match indices.index_type() {
            IndexType::U8 => ItemIter::<u8>::new(bytes, stride).map(u32::from).collect(),
            IndexType::U16 => ItemIter::<u16>::new(bytes, stride).map(u32::from).collect(),
            IndexType::U32 => ItemIter::<u32>::new(bytes, stride).collect(),
        };
        if let Some(i) = places.iter().find(|i| **i as usize >= count) {
            return Err(node.fail(format!("there is no element {i}"), "export the file again"));
        }
        if places.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(node.fail("the places of sparse values do not rise", "export the file again"));
        }
        Ok(())
    }
}
