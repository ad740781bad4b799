// Short names of scoped styles: they stand at every element of the built page.
export default { compilerOptions: { runes: true, discloseVersion: false, cssHash: ({ hash, css }) => `s${hash(css).slice(0, 3)}` } }
