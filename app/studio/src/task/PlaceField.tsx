import { Button } from "../ui/Button";
import { Section } from "../ui/Section";
import { placing, tab } from "../store/state";

/** Opens the search for a place of the robot. */
export function PlaceField() {
  const open = () => {
    placing.value = true;
    tab.value = "answer";
  };
  return (
    <Section title="Placement" id="place">
      <Button id="place-robot" disabled={placing.value} onClick={open}>
        Find the best place …
      </Button>
    </Section>
  );
}
