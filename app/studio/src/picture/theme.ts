// Colours of the page's style, as they are now.
import * as THREE from "three";
import { style } from "../ui/style";

export const colour = (name: string) => new THREE.Color(style(name)).getHex();
