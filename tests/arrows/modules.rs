//! Which file of a package names what is defined in which other file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, UseTree, Visibility};

/// A path of names, from the root of the package.
type Names = Vec<String>;

/// A package's files and, for each, the files whose definitions it names. Tests are left out.
pub(crate) struct Package {
    root: PathBuf,
    modules: BTreeMap<Names, Module>,
}

struct Module {
    file: PathBuf,
    /// What the module brings in: the name here, and the path it stands for.
    imported: BTreeMap<String, Names>,
    /// Modules all of whose names are brought in.
    globs: Vec<Names>,
    /// Paths that the file names, but for those that it only hands on to others.
    named: Vec<Names>,
}

impl Package {
    pub(crate) fn read(root: &Path) -> Self {
        let mut files = Vec::new();
        collect(root, &mut files);
        assert!(files.len() > 2, "{}: no sources", root.display());
        // A program in the package of a library is a package of its own, and uses the library from
        // outside.
        if files.contains(&root.join("lib.rs")) {
            files.retain(|file| *file != root.join("main.rs"));
        }
        let modules = files.into_iter().map(|file| {
            let path = module_path(root, &file);
            let module = Module::read(&file, &path);
            (path, module)
        });
        let modules = modules.collect();
        Self { root: root.to_path_buf(), modules }
    }

    /// For each file the files whose definitions it names; paths from the package's root.
    pub(crate) fn edges(&self) -> BTreeMap<PathBuf, BTreeSet<PathBuf>> {
        let relative = |file: &Path| file.strip_prefix(&self.root).unwrap().to_path_buf();
        let edges = self.modules.values().map(|module| {
            let targets = module.named.iter().filter_map(|names| self.resolve(names, 0));
            let others = targets.filter(|target| **target != module.file).map(|t| relative(t));
            (relative(&module.file), others.collect())
        });
        edges.collect()
    }

    /// The file in which the path's name is defined.
    fn resolve(&self, names: &[String], depth: usize) -> Option<&PathBuf> {
        assert!(depth < 20, "{}: {names:?} stands for itself", self.root.display());
        let length = (0..=names.len()).rev().find(|n| self.modules.contains_key(&names[..*n]))?;
        let module = &self.modules[&names[..length]];
        let Some(name) = names.get(length) else { return Some(&module.file) };
        let follow =
            |target: &[String], rest: &[String]| self.resolve(&[target, rest].concat(), depth + 1);
        if let Some(target) = module.imported.get(name) {
            return follow(target, &names[length + 1..]);
        }
        let in_glob = |glob: &&Names| {
            self.modules.get(*glob).is_some_and(|module| module.imported.contains_key(name))
        };
        match module.globs.iter().find(in_glob) {
            Some(glob) => follow(glob, &names[length..]),
            None => Some(&module.file),
        }
    }
}

impl Module {
    fn read(file: &Path, path: &[String]) -> Self {
        let text = fs::read_to_string(file).unwrap();
        let parsed = syn::parse_file(&text).unwrap();
        let children = parsed.items.iter().filter_map(|item| match item {
            Item::Mod(module) if module.content.is_none() => Some(module.ident.to_string()),
            _ => None,
        });
        let mut reader = Reader {
            path,
            children: children.collect(),
            module: Self {
                file: file.to_path_buf(),
                imported: BTreeMap::new(),
                globs: Vec::new(),
                named: Vec::new(),
            },
        };
        reader.visit_file(&parsed);
        reader.module
    }
}

struct Reader<'a> {
    path: &'a [String],
    children: BTreeSet<String>,
    module: Module,
}

impl Reader<'_> {
    /// The path from the package's root; nothing when it leads into another package.
    fn absolute(&self, names: &[String]) -> Option<Names> {
        let mut path = self.path.to_vec();
        let mut rest = names;
        match rest.first()?.as_str() {
            "crate" => (path, rest) = (Names::new(), &rest[1..]),
            "self" => rest = &rest[1..],
            "super" => {}
            first if self.children.contains(first) => {}
            _ => return None,
        }
        while rest.first().is_some_and(|name| name == "super") {
            path.pop()?;
            rest = &rest[1..];
        }
        path.extend_from_slice(rest);
        Some(path)
    }

    fn import(&mut self, tree: &UseTree, before: &mut Names, handed_on: bool) {
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.import(&path.tree, before, handed_on);
                before.pop();
            }
            UseTree::Group(group) => {
                group.items.iter().for_each(|item| self.import(item, before, handed_on));
            }
            UseTree::Name(name) => self.bring_in(before, &name.ident, &name.ident, handed_on),
            UseTree::Rename(name) => self.bring_in(before, &name.ident, &name.rename, handed_on),
            UseTree::Glob(_) => {
                let Some(glob) = self.absolute(before) else { return };
                if !handed_on {
                    self.module.named.push(glob.clone());
                }
                self.module.globs.push(glob);
            }
        }
    }

    fn bring_in(&mut self, before: &[String], of: &syn::Ident, name: &syn::Ident, handed_on: bool) {
        let mut path = before.to_vec();
        if of != "self" {
            path.push(of.to_string());
        }
        let Some(target) = self.absolute(&path) else { return };
        if !handed_on {
            self.module.named.push(target.clone());
        }
        let name = if name == "self" { path.last().cloned() } else { Some(name.to_string()) };
        // A module that bears its own name stands for itself.
        if let Some(name) =
            name.filter(|name| [self.path, std::slice::from_ref(name)].concat() != target)
        {
            self.module.imported.insert(name, target);
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item_mod(&mut self, module: &'ast ItemMod) {
        if !is_test(&module.attrs) {
            visit::visit_item_mod(self, module);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        if !is_test(&item.attrs) {
            let handed_on = !matches!(item.vis, Visibility::Inherited);
            self.import(&item.tree, &mut Names::new(), handed_on);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Names = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if names.len() > 1
            && let Some(names) = self.absolute(&names)
        {
            self.module.named.push(names);
        }
        visit::visit_path(self, path);
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Ident>().is_ok_and(|flag| flag == "test")
    })
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() && name != "tests" {
            collect(&path, files);
        } else if name.ends_with(".rs") && name != "tests.rs" {
            files.push(path);
        }
    }
}

fn module_path(root: &Path, file: &Path) -> Names {
    let relative = file.strip_prefix(root).unwrap().with_extension("");
    let names = relative.iter().map(|name| name.to_str().unwrap().to_owned());
    names.filter(|name| !matches!(name.as_str(), "mod" | "lib" | "main")).collect()
}
