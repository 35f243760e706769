/// Photosites that do not measure light: hot ones are bright in the dark, dead ones dark in the light. What they say is left
/// out wherever it would count.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Defects {
    hot: Vec<[u32; 2]>,
    dead: Vec<[u32; 2]>,
    /// Both, by row and column, each once.
    all: Vec<[u32; 2]>,
}

impl Defects {
    /// From columns and rows, counted from the frame's top left, in any order.
    pub fn new(mut hot: Vec<[u32; 2]>, mut dead: Vec<[u32; 2]>) -> Self {
        let by_row = |[x, y]: &[u32; 2]| (*y, *x);
        hot.sort_unstable_by_key(by_row);
        dead.sort_unstable_by_key(by_row);
        let mut all = [hot.as_slice(), dead.as_slice()].concat();
        all.sort_unstable_by_key(by_row);
        all.dedup();
        Self { hot, dead, all }
    }

    /// Column and row of those bright in the dark, by row.
    pub fn hot(&self) -> &[[u32; 2]] {
        &self.hot
    }

    /// Column and row of those dark in the light, by row.
    pub fn dead(&self) -> &[[u32; 2]] {
        &self.dead
    }

    /// How many photosites in all.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// The defective columns of row `y` from column `from` on, ascending.
    pub fn columns(&self, y: usize, from: usize) -> impl Iterator<Item = usize> + '_ {
        let before = |[column, row]: &[u32; 2]| (*row as usize, *column as usize) < (y, from);
        let start = self.all.partition_point(before);
        let in_row = self.all[start..].iter().take_while(move |[_, row]| *row as usize == y);
        in_row.map(|[column, _]| *column as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_knows_its_own() {
        let defects = Defects::new(vec![[9, 2], [3, 2], [0, 0]], vec![[3, 2], [7, 4], [5, 2]]);
        let columns = |y, from| defects.columns(y, from).collect::<Vec<_>>();
        assert_eq!(defects.count(), 5);
        assert_eq!(columns(2, 0), [3, 5, 9]);
        assert_eq!(columns(2, 4), [5, 9]);
        assert_eq!(columns(0, 0), [0]);
        assert_eq!((columns(1, 0), columns(0, 1), columns(9, 0)), (vec![], vec![], vec![]));
    }
}
