import { Section } from "../ui/Section";
import { Table } from "../ui/Table";
import { layer, look, mapShown } from "../store/placement";
import { columnsOf, LEFT_OUT, MOUNTS, REASONS, valuesOf } from "../store/places";
import type { Mount } from "../store/places";
import { trying } from "../store/trouble";
import { shown } from "../store/units";

const MOST = 200; // rows

/** The places of the map as a table, and which of them the picture shows. */
export function MapTable() {
  const map = mapShown.value;
  if (!map) return null;
  const { height, mount } = layer.value;
  const heights = valuesOf(map.places, 2);
  const mounts = MOUNTS.filter((each) => map.places.some((place) => place.mount === each));
  const columns = columnsOf(map.places, layer.value).sort(
    (a, b) => (a.energy ?? Infinity) - (b.energy ?? Infinity),
  );
  return (
    <Section title="Map" note={`${map.places.length} places`} id="map">
      {heights.length > 1 && (
        <label class="field">
          <span>Height</span>
          <select
            value={height ?? ""}
            onChange={({ currentTarget: { value } }) =>
              (layer.value = { ...layer.value, height: value === "" ? null : Number(value) })
            }
          >
            <option value="">best of all</option>
            {heights.map((value) => (
              <option key={value} value={value}>
                {shown(value, "mm")} mm
              </option>
            ))}
          </select>
        </label>
      )}
      {mounts.length > 1 && (
        <label class="field">
          <span>Mount</span>
          <select
            value={mount ?? ""}
            onChange={({ currentTarget: { value } }) =>
              (layer.value = { ...layer.value, mount: (value as Mount) || null })
            }
          >
            <option value="">best of all</option>
            {mounts.map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        </label>
      )}
      <Table
        label="Places of the map"
        head={["x, y, z mm", "yaw °", "J"]}
        rows={columns.slice(0, MOST).map((place, k) => ({
          key: k,
          title: place.mount ?? undefined,
          cells: [
            <button
              type="button"
              class="plain"
              title="Select this place"
              onClick={trying(() => look(place.pose))}
            >
              {place.at.map((value) => shown(value, "mm")).join(", ")}
            </button>,
            shown(place.yaw, "deg"),
            place.energy ?? (place.reason ? REASONS[place.reason] : LEFT_OUT),
          ],
        }))}
      />
    </Section>
  );
}
