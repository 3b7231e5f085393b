// One HTML file of the whole client: `node build.mjs OUTPUT DIGEST`.
import { readFile, writeFile } from "node:fs/promises";
import { build } from "esbuild";

const common = { bundle: true, minify: true, write: false, charset: "utf8", target: "es2022", legalComments: "eof" };
const script = await build({ ...common, entryPoints: ["src/main.ts"], format: "iife" });
const style = await build({ ...common, entryPoints: ["src/style.css"] });
const parts = { "/*script*/": script.outputFiles[0].text, "/*style*/": style.outputFiles[0].text };
let page = await readFile("src/page.html", "utf8");
page = page.replace("<!doctype html>", `<!doctype html><!-- ${process.argv[3]} -->`);
for (const [mark, text] of Object.entries(parts)) page = page.replace(mark, () => text.trim());
await writeFile(process.argv[2], page);
